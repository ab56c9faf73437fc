"""The words: names, docstrings, messages and pages say what `CONTRIBUTING.md` says, and not what it says not."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

BANNED = {
    "foot": r"\b(?:foot|feet)\b",
    "clots": r"\bclots?\b",
    "streaks": r"\bstreak\w*",
    "banding": r"\bbanding\b",
    "realism, likeness": r"\b(?:realism|likeness)\b",
    "halvings": r"\bhalvings\b",
    "warp (of the solver)": r"\bwarp(?:s|ed|ing)?\b",
    "push": r"\bpush(?:es|ed|ing)?\b",
    "thinning": r"\bthinning\b",
    "guess, evidence guess": r"\bguess\w*",
    "look, sight, first look, evidence": r"\b(?:evidence|sight|looked at|looking at|look at (?:a|any|every|the|an)\b"
    r"|(?:a|an|one|first|another|second|earlier|later) look)\b|\bfirst_look\b|\bFirstLook\b|\bdef looks\b|\bSight\b",
    "turn_run": r"\bturn_run\b",
    "hold back": r"\b(?:hold(?:s|ing)?|held)[ _]back\b",
    "told, not told": r"\b(?:un)?told\b",
    "met": r"\bmet\b",
    "FEWEST, MOST, LEAST": r"\b(?:FEWEST|MOST|LEAST)(?:_[A-Z_]+)?\b",
    "Wave::cos1": r"\bWave::\w+",
}
"""What the table says not, as it stands there, and how it is found."""

CASED = ("FEWEST, MOST, LEAST", "Wave::cos1")
"""Those of which capital letters make another word."""

ALLOWED = (
    r"line of sight",
    r"look-up",
    r"a look of its own",  # what *Look* in Blender sets
    r"visibility push",
    r"push-pull",  # the algorithm of Gortler et al.
    r"guessed_rate",  # an attribute of PyAV's streams
    r"warp[ _]error|warps? a density exactly",  # a measure of the literature
    r"looks? at (?:the|a|an) (?:screen|point|zip)",
)
"""Standard terms, and cameras, which look at something."""

EXCEPTIONS = {"tests/test_vocabulary.py": "the list itself", "CONTRIBUTING.md": "the table itself"}
"""Where other words still stand, by the beginning of the path, and why."""

STANDARD = re.compile("|".join(ALLOWED), re.IGNORECASE)
FOUND = re.compile("|".join(pattern if words in CASED else f"(?i:{pattern})" for words, pattern in BANNED.items()))

FOLDERS = ("addon", "benchmarks", "cpp", "docs", "engine", "examples", "integrations", "tests", "tools")
SUFFIXES = {".cpp", ".h", ".md", ".py", ".pyi", ".toml"}


def name(path: Path) -> str:
    """The path within the checkout."""
    return path.relative_to(ROOT).as_posix()


FILES = [
    path
    for path in [*ROOT.glob("*.md"), *(path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*")))]
    if path.suffix in SUFFIXES and not name(path).startswith(tuple(EXCEPTIONS))
]


def banned(text: str) -> set[str]:
    """What of a text the table says not."""
    lines = " ".join(line.strip().lstrip("#/ ") for line in text.splitlines())
    return {match[0] for match in FOUND.finditer(re.sub(STANDARD, "", lines))}


def test_files_have_the_words_of_the_field() -> None:
    found = {name(path): banned(path.read_text(encoding="utf-8")) for path in FILES}
    assert {path: words for path, words in found.items() if words} == {}


def test_the_table_is_what_is_enforced() -> None:
    rows = re.findall(
        r"^\| ([^|]+) \| ([^|]+) \|$", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert {avoided for say, avoided in rows if say != "say" and "---" not in say} == set(BANNED)


BRITISH = re.compile(
    r"(?i)colour|grey|metres?\b|neighbour|behaviour|centre|licences?\b|honour|quantis"
    r"|(?:linear|regular|initial|normal|minim|maxim|optim|stabil)is(?:e[ds]?|ing|ation)"
)
"""Spellings that Blender does not have."""

CONTRACT = re.compile(r"(?:\b|\\n)centre\b|\b(?:\w+_)?centres\b")
"""Names that other programs call: a scene's key, and the values of a velocity at voxels."""


def test_there_is_one_spelling() -> None:
    """All pages, and the code with its comments."""
    found = {name(path): set(BRITISH.findall(CONTRACT.sub("", path.read_text(encoding="utf-8")))) for path in FILES}
    assert {path: words for path, words in found.items() if words} == {}


def test_types_of_arrays_have_one_module() -> None:
    aliases = re.compile(r"^(?:Array|Doubles|Floats|Mask|Values) = (?:npt\.)?NDArray\[np\.\w+\]$", re.MULTILINE)
    found = {name(path) for path in FILES if aliases.search(path.read_text(encoding="utf-8"))}
    assert {path for path in found if path.endswith(".py")} == {"engine/smokelift/checks/__init__.py"}
