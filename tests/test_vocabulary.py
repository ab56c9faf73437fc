"""Names, comments and pages have the words of CONTRIBUTING.md's table and Blender's spelling."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("addon", "benchmarks", "cpp", "docs", "engine", "examples", "integrations", "tests", "tools")
PATHS = [*ROOT.glob("*.md"), *(path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*")))]
TEXTS = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in PATHS
    if path.suffix in {".cpp", ".h", ".md", ".py", ".pyi", ".toml"} and path != Path(__file__)
}
CONTRIBUTING = TEXTS.pop("CONTRIBUTING.md")
AVOIDED = ", ".join(re.findall(r"^\| [^|]+ \| ([^|]+) \|$", CONTRIBUTING, re.MULTILINE)[2:]).split(", ")

BRITISH = (
    r"colour|grey|metres?\b|neighbour|behaviour|(?<![a-z_\\n])centre(?!s?\b)|licences?\b|honour|quantis"
    r"|(?:linear|regular|initial|normal|minim|maxim|optim|stabil)is(?:e[ds]?|ing|ation)"
)


def one_of(words: list[str]) -> str:
    """A pattern of whole words, which an underscore separates."""
    return rf"(?<![A-Za-z])(?:{'|'.join(words)})(?![A-Za-z])"


def names_of(source: str) -> Iterator[str]:
    """What a module defines: functions but for tests, classes, parameters and variables."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("test_"):
            yield node.name
        elif isinstance(node, ast.arg) or (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)):
            yield node.arg if isinstance(node, ast.arg) else node.id


@pytest.mark.parametrize("pattern", [one_of([word for word in AVOIDED if "`" not in word]), BRITISH])
def test_files_avoid_words(pattern: str) -> None:
    found = {path: set(re.findall(pattern.lower(), text.lower())) for path, text in TEXTS.items()}
    assert {path: words for path, words in found.items() if words} == {}


def test_names_avoid_words() -> None:
    avoided = re.compile(one_of([word.strip("`") for word in AVOIDED if "`" in word]))
    modules = {path: text for path, text in TEXTS.items() if path.endswith(".py")}
    assert {(path, name) for path, text in modules.items() for name in names_of(text) if avoided.search(name)} == set()


def test_types_of_arrays_have_one_module() -> None:
    aliases = re.compile(r"^(?:Array|Doubles|Floats|Mask|Values) = (?:npt\.)?NDArray\[np\.\w+\]$", re.MULTILINE)
    found = {path for path, text in TEXTS.items() if path.endswith(".py") and aliases.search(text)}
    assert found == {"engine/smokelift/checks/__init__.py"}
