"""The documents: every path that they or the code name exists, and pages keep their form."""

import re
import subprocess
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
ENGINE = ROOT / "engine" / "smokelift"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
EXPERIMENTS = sorted((DOCS / "experiments").glob("*.md"))
SOURCES = [
    path
    for folder in ("addon", "benchmarks", "cpp", "engine", "tools")
    for path in sorted((ROOT / folder).rglob("*"))
    if path.suffix in {".py", ".pyi", ".cpp", ".h", ".md"}
]

LINK = re.compile(r"\]\(([^)#\s]+)[^)]*\)")
DOCUMENT = re.compile(r"\bdocs/[\w\-./]*\w")
MODULE = re.compile(r"python -m (benchmarks[\w.]*)")
ARROWS = re.compile(r"^ {4}(\w+(?: --> \w+)+)$", re.MULTILINE)
IMPORT = re.compile(r"^\s*(?:from|import) smokelift\.([a-z]\w*)", re.MULTILINE)
FUNCTION = re.compile(r"\b([\w/]+\.py):(\w+)")
FILE = re.compile(r"\b(\w+(?:/\w+)+\.(?:py|cpp|h))\b")
CONSTANT = re.compile(r"`([A-Z][A-Z_]+)`")
COMMIT = re.compile(r"\b(?=[0-9a-f]*\d)(?=[0-9a-f]*[a-f])[0-9a-f]{7,8}\b")
SEVERAL_NUMBERS = re.compile(r"\d\s*%? / [-+(.]?\d|^ *[-+]?[\d.]+ ?%?(?:[,;] [-+]?[\d.]+ ?%?)+ *$")

PAGE = 65
"""Lines of a decision record, at most: it is read on one page."""

MEASURED = [*EXPERIMENTS, *sorted(DOCS.glob("*.md"))]
"""Pages with figures."""


def name(path: Path) -> str:
    """The path within the checkout."""
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_of_a_page_and_benchmarks_that_it_runs_exist(page: Path) -> None:
    text = page.read_text()
    links = [link for link in LINK.findall(text) if not link.startswith(("http:", "https:", "mailto:"))]
    assert [link for link in links if not (page.parent / link).exists()] == []
    paths = {module: ROOT / module.replace(".", "/") for module in MODULE.findall(text)}
    assert [m for m, path in paths.items() if not (path.is_dir() or path.with_suffix(".py").is_file())] == []


def test_documents_named_anywhere_exist() -> None:
    missing = {
        (name(path), document)
        for path in (*PAGES, *SOURCES)
        for document in DOCUMENT.findall(path.read_text())
        if not (ROOT / document).exists()
    }
    assert missing == set()


def test_the_architecture_names_what_there_is() -> None:
    missing = [
        f"{path}:{function}"
        for path, function in FUNCTION.findall((ROOT / "ARCHITECTURE.md").read_text())
        if not re.search(rf"^(def |class )?{function}\b", (ENGINE / path).read_text(), re.MULTILINE)
    ]
    assert missing == []


def test_the_map_of_the_architecture_names_modules_that_there_are() -> None:
    _, engine, addon = re.split(r"## What is where in the engine|## The add-on", (ROOT / "ARCHITECTURE.md").read_text())
    for folder, text in ((ENGINE, engine), (ROOT / "addon", addon.partition("## The core")[0])):
        for package, modules in re.findall(r"^\| `([a-z]+)`: [^|]*\|(.*)", text, re.MULTILINE):
            there = {path.stem for path in (folder / package).iterdir()} | {"engine_command"}
            assert set(re.findall(r"`([a-z]+(?:_[a-z]+)*)`", modules)) - there == set(), package


@pytest.mark.parametrize("page", [*sorted(ROOT.glob("*.md")), *MEASURED], ids=name)
def test_files_of_the_code_that_a_page_names_exist(page: Path) -> None:
    named = {file for file in FILE.findall(page.read_text()) if "NAME" not in file}
    assert [file for file in sorted(named) if not ((ENGINE / file).exists() or (ROOT / file).exists())] == []


def test_imports_follow_the_arrows_of_the_architecture() -> None:
    below: dict[str, set[str]] = {}
    for chain in ARROWS.findall((ROOT / "ARCHITECTURE.md").read_text()):
        for upper, lower in pairwise(chain.split(" --> ")):
            below.setdefault(upper, set()).add(lower)

    def reached(package: str) -> set[str]:
        return {package}.union(*map(reached, below.get(package, ())))  # endless if the arrows had a circle

    packages = [path for path in ENGINE.iterdir() if (path / "__init__.py").exists()]
    imported = {
        (package.name, other)
        for package in packages
        for path in package.rglob("*.py")
        for other in IMPORT.findall(path.read_text())
    }
    assert {package.name for package in packages} == set(below) | set().union(*below.values())
    assert {(package, other) for package, other in imported if other not in reached(package)} == set()
    assert {(upper, lower) for upper in below for lower in below[upper]} - imported == set()


def test_pictures_of_the_docs_are_shown() -> None:
    text = "".join(page.read_text() for page in PAGES)
    assert [path.name for path in sorted(DOCS.glob("*.*")) if path.suffix != ".md" and path.name not in text] == []


@pytest.mark.parametrize("page", EXPERIMENTS, ids=name)
def test_an_experiment_has_its_four_parts_on_a_page(page: Path) -> None:
    lines = page.read_text().splitlines()
    assert [line for line in lines if line.startswith("## ")] == ["## Question", "## Setting", "## Table", "## Answer"]
    assert len(lines) <= PAGE


def test_an_experiment_decides_something_that_is_there() -> None:
    named = "".join(path.read_text() for path in (*PAGES, *SOURCES))
    assert [page.stem for page in EXPERIMENTS if not re.search(rf"\b{page.stem}\.md", named)] == []


def test_constants_that_records_chose_exist() -> None:
    known = {word for path in ENGINE.rglob("*.py") for word in re.findall(r"\w+", path.read_text())}
    named = {(page.stem, constant) for page in EXPERIMENTS for constant in CONSTANT.findall(page.read_text())}
    assert {(page, constant) for page, constant in named if constant not in known} == set()


@pytest.mark.parametrize("page", MEASURED, ids=name)
def test_a_cell_of_a_table_has_one_number(page: Path) -> None:
    rows = [line for line in page.read_text().splitlines() if line.startswith("|")]
    assert [cell for row in rows for cell in row.split("|") if SEVERAL_NUMBERS.search(cell)] == []


def test_commits_that_pages_name_exist() -> None:
    named = {commit for page in PAGES for commit in COMMIT.findall(page.read_text())}
    ended = subprocess.run(["git", "rev-list", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)
    if ended.returncode or len(ended.stdout.split()) < 100:
        pytest.skip("this is no clone with the whole history")
    known = {commit[:length] for commit in ended.stdout.split() for length in (7, 8)}
    assert named - known == set()


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=name)
def test_a_page_that_describes_has_no_history_and_no_target(page: Path) -> None:
    text = page.read_text()
    assert not re.search(rf"\b(?:[Uu]ntil|[Bb]efore|[Ss]ince) {COMMIT.pattern}", text)
    assert not re.search(r"\basked\b", text)
