"""Every numeric constant of engine, core and add-on: value, meaning with unit, and what set it, read from the code.

python tools/constants.py        # prints what the manual's page "Constants" shows
"""

import ast
import html
import re
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]

BY_HAND = "by hand"

SWEEPS = {
    "addon": "No benchmark moves them: limits and waits, and how a result is set up and shown.",
    "app": "No benchmark moves them: they bound arguments, and say when something is said.",
    "baselines": "`python -m benchmarks.accuracy OUT SCENES/plume-1 --runs paper`",
    "batch": "No benchmark moves them: they are waits for other programs, and tries.",
    "checks": "`python -m benchmarks.stability FOLDER` shows that what lies beyond is refused; nothing moves them.",
    "cpp": "Portions and lanes: `python -m benchmarks.renderer` and `python -m benchmarks.velocity "
    "SCENES/plume-1/truth.npz`; `diffuse_light`: `python -m benchmarks.renderer.agreement --mitsuba PYTHON`; "
    "`extraction`, `projected_cg`: as the packages `extraction`, `velocity`.",
    "density": "`python -m benchmarks.accuracy OUT SCENES/{plume,two,jet,puff}-1 --runs balanced balanced:detail=0`",
    "direct": "`python -m benchmarks.direct.continuation SCENES/{plume,two,jet}-1`; growth, wind and loops: "
    "`python -m benchmarks.direct.leaving SMOKE OUT`",
    "evaluation": "They define the scores. `python -m benchmarks.accuracy OUT SCENES/plume-1 --runs truth black` says "
    "what the true density gets, and none.",
    "extraction": "Elements and hidden plates: `python -m benchmarks.extraction OUT SCENES/{plume,puff}-1 --plates "
    "planks sky --known given frame unknown --black`; other plates and the matte: `python -m benchmarks.background "
    "SCENES/plume-1 SCENES/jet-2`. No benchmark moves a camera or burns.",
    "footage": "Noise and exposure: `python -m benchmarks.disturbances OUT SCENES/plume-1 --only noise crf flicker "
    "flicker-gray --methods default`; `images`: as `extraction`. No benchmark moves limits of files and memory.",
    "output": "No benchmark moves them: formats, limits of files, and how pictures are laid out.",
    "render": "`python -m benchmarks.renderer.agreement --mitsuba PYTHON`",
    "report": "No benchmark moves them: they lay a page out, and say when something is said.",
    "scene": "`python -m benchmarks.stability FOLDER` shows that what lies beyond is refused; nothing moves them.",
    "setup": "Color of the smoke: `python -m benchmarks.background SCENES/plume-1 SCENES/jet-2 --colors`; grid: "
    "`python -m benchmarks.accuracy OUT SCENES/plume-1 --runs fine:resolution=auto`. No benchmark assumes the camera, "
    "the box or the light.",
    "transport": "`python -m benchmarks.direct.continuation SCENES/{plume,two,jet}-1`",
    "velocity": "`python -m benchmarks.velocity SCENES/plume-1/truth.npz`; `optical_flow`: `python -m "
    "benchmarks.accuracy OUT SCENES/plume-1 --runs balanced:detail=0`",
}
"""For each package with constants set by hand, what measures a change of them."""

PAGE = re.compile(r"\bdocs/([\w/-]+)\.md")
SOURCE = re.compile(r"\((by hand|by definition|measured|[^()]*\b(?:ITU-[RT]|SMPTE|(?:19|20)\d\d)\b[^()]*)")
OF_MODULE = re.compile(r"Constants that say no other source: (docs/[\w/-]+\.md)")
REPEATED = re.compile(r" \((?:by hand|by definition|docs/[^()]*)\)")
"""What the column of sources says again."""

DECLARED = re.compile(r"(?:    static )?constexpr (?:float|double|int|std::size_t) ([^;]*);(?: +// (.*))?")
DECLARATIONS = re.compile(rf"((?:^ *//.*\n)*)((?:^{DECLARED.pattern}\n)+)", re.MULTILINE)
"""Lines of C++, outside functions, that declare numbers, and the comment above them."""

LITERAL = re.compile(r'(?:"[^"]*"|[-\d\s(),.*e_])+')
"""The add-on's values that are numbers alone, and the words for them: no paths, flags or interfaces of nodes."""


class Constant(NamedTuple):
    """A numeric constant, or those of one line; ``meaning`` is its docstring, empty if it has none."""

    module: str
    name: str
    value: str
    meaning: str
    set_by: str


@cache
def constants(path: Path) -> list[Constant]:
    """Return the constants of a module in whose values there are numbers, in the order of its lines."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return _of_cpp(path, text)
    tree, lines = ast.parse(text), text.splitlines()
    of_module = "".join(OF_MODULE.findall(" ".join((ast.get_docstring(tree) or "").split())))
    module = path.parent.name if path.stem == "__init__" else path.stem
    found = []
    for node, after in pairwise([*tree.body, ast.Pass()]):
        match node:
            case ast.Assign(targets=[target], value=value) | ast.AnnAssign(target=target, value=ast.expr() as value):
                name = ast.unparse(target).strip("()")
            case _:
                continue
        match after:
            case ast.Expr(value=ast.Constant(value=str() as string)):
                meaning = " ".join(string.split())
            case _:
                meaning = lines[(node.end_lineno or 1) - 1].partition("  # ")[2]
        if name.isupper() and any(_is_number(part) for part in ast.walk(value)):
            written = " ".join((ast.get_source_segment(text, value) or "").split())
            found.append(Constant(module, name, written, meaning, _source(meaning) or _source(of_module) or BY_HAND))
    return found


def packages() -> dict[str, list[Constant]]:
    """Return the constants of every package of the engine, of the core and of the add-on, whose panels only show."""
    folders = [path.parent for path in (ROOT / "engine" / "smokelift").glob("*/__init__.py")]
    files = {folder.name: sorted(folder.rglob("*.py")) for folder in folders}
    files["addon"] = [path for path in sorted((ROOT / "addon").rglob("*.py")) if path.parent.name != "panel"]
    files["cpp"] = sorted(path for path in (ROOT / "cpp").iterdir() if path.suffix in (".cpp", ".h"))
    found = {name: [row for path in files[name] for row in constants(path)] for name in sorted(files)}
    found["addon"] = [row for row in found["addon"] if LITERAL.fullmatch(row.value)]
    return {name: rows for name, rows in found.items() if rows}


def markdown() -> str:
    """Return the constants of every package as a table below its sweep."""
    parts = []
    for name, rows in packages().items():
        count = sum(row.set_by == BY_HAND for row in rows)
        parts += [f"## {name}", f"Set by hand: {count} of {len(rows)}. {SWEEPS.get(name, '')}", _table(rows)]
    return "\n\n".join(parts)


def _of_cpp(path: Path, text: str) -> list[Constant]:
    """Constants of a C++ file, each with the comment above its lines and that beside it."""
    found = []
    for above, lines, *_ in DECLARATIONS.findall(re.sub(r"\n {8,}//", "", text)):
        for declared, beside in DECLARED.findall(lines):
            meaning = " ".join(f"{above} {beside}".replace("//", " ").split())
            for each in re.split(r", (?=\w+(?:\[\w+\])* = )", declared):
                name, _, value = each.partition(" = ")
                if re.search(r"\d", value):
                    name = name.partition("[")[0]
                    found.append(Constant(path.name, name, value, meaning, _source(meaning) or BY_HAND))
    return found


def _table(rows: list[Constant]) -> str:
    lines = ["| module | name | value | meaning | set by |", "| --- | --- | --- | --- | --- |"]
    for row in rows:
        meaning = html.escape(REPEATED.sub("", row.meaning), quote=False)
        cells = (f"`{row.module}`", f"`{row.name}`", f"`{row.value}`", meaning, row.set_by)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines)


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _source(text: str) -> str:
    """What a text names as its source: pages of the manual, references, a definition, a measurement; empty if none."""
    pages = [f"[{page.rpartition('/')[2]}]({page}.md)" for page in dict.fromkeys(PAGE.findall(text))]
    return "; ".join([*pages, *SOURCE.findall(text)])


if __name__ == "__main__":
    sys.stdout.write(markdown() + "\n")
