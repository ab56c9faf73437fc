"""The manual: its commands are real ones, its examples run, and what it lists is what the code has."""

import argparse
import ast
import doctest
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

import command_reference
import messages
import notebook
import scene_reference
import smokelift
from smokelift.app.cli import command_parser
from smokelift.scene import Scene, SceneError, scene_from_dict
from tests.test_docs import DOCS, PAGES, ROOT, name

MADE = re.compile(r"<!-- made by tools/(\w+)\.py -->")
SAID = re.compile(r"“([^”]+)”")
WORDS = re.compile(r"\w+")


def commands(page: Path, program: str) -> list[str]:
    """The lines of a page's code blocks that begin with a program, without comments and continuations."""
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    fenced = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    indented = re.findall(
        r"^ {4}(\S.*)$", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL), re.MULTILINE
    )
    lines = [*indented, *(line for block in fenced for line in block.splitlines())]
    return [re.split(r"\s+#|\s+\|\s", line)[0] for line in lines if re.match(rf"(?:venv/bin/)?{program} ", line)]


def mentions(page: Path) -> Iterator[list[str]]:
    """The words of every command `smokelift` that stands in a sentence or a table of a page, as far as they go."""
    for code in re.findall(r"`smokelift ([a-z][^`]*)`", page.read_text(encoding="utf-8")):
        yield code.replace("\\|", "|").split()


def parse(words: list[str]) -> None:
    """Parse the words after the program as the command line does."""
    try:
        command_parser().parse_args(words[1:])
    except SystemExit as refused:
        pytest.fail(f"refused: {' '.join(words)}: {refused}")


MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"^\.PHONY: (.*)$", MAKEFILE, re.MULTILINE)[0].split())
BLENDERS = ast.walk(ast.parse((ROOT / "addon" / "result" / "command_line.py").read_text(encoding="utf-8")))
OPTIONS = {node.value for node in BLENDERS if isinstance(node, ast.Constant) and isinstance(node.value, str)}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_commands_of_a_page_are_taken(page: Path) -> None:
    """By the engine, by make and by Blender."""
    for line in commands(page, "smokelift"):
        parse(shlex.split(line))
    assert {line.split()[1] for line in commands(page, "make")} <= TARGETS
    for line in commands(page, "blender"):
        assert set(re.findall(r"--[a-z][a-z-]*", line.partition("smokelift reconstruct")[2])) <= OPTIONS


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_commands_in_sentences_exist_with_their_options(page: Path) -> None:
    known = command_reference.subcommands()
    for command, *words in mentions(page):
        assert command in known, command
        options = {option for action in known[command]._actions for option in action.option_strings}
        given = {re.split(r"[=|.,]", word.strip("[]"))[0] for word in words if word.lstrip("[").startswith("--")}
        assert given <= options, (command, given - options)


@pytest.mark.parametrize("page", ["python.md", "extending.md"])
def test_examples_of_a_page_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    result = doctest.testfile(str(DOCS / page), module_relative=False, optionflags=flags, encoding="utf-8")
    assert result.failed == 0 and result.attempted > 20


def test_examples_of_docstrings_run() -> None:
    public = [getattr(smokelift, each) for each in smokelift.__all__ if each != "metrics"]
    found = [test for each in public for test in doctest.DocTestFinder().find(each) if test.examples]
    assert len(found) >= 7
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for test in found:
        assert runner.run(test).failed == 0, test.name


def test_every_public_name_has_an_example_that_runs() -> None:
    assert len(smokelift.__all__) <= 28
    page = doctest.DocTestParser().get_examples((DOCS / "python.md").read_text(encoding="utf-8"))
    used = {word for example in page for word in re.findall(r"smokelift\.(\w+)", example.source)}
    assert set(smokelift.__all__) - used == set()


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=name)
def test_every_example_in_python_is_run(page: Path) -> None:
    assert ">>>" not in page.read_text(encoding="utf-8") or page.name in ("python.md", "extending.md")
    assert "```python" not in page.read_text(encoding="utf-8")


def test_the_api_page_shows_every_public_name() -> None:
    page = (DOCS / "api.md").read_text(encoding="utf-8")
    shown = re.findall(r"^(?:::: |      heading: )smokelift\.(\w+)$", page, re.MULTILINE)
    assert set(shown) == set(smokelift.__all__)


def test_the_scene_reference_has_every_key_that_the_reader_takes() -> None:
    listed = scene_reference.tables()
    asked = {header: header.strip("[]").partition("]")[0] for header in listed}
    for header, table in asked.items():
        content: object = {"nothing": 0}
        if header.startswith("[["):
            kind = re.search(r'type "(\w+)"', header)
            content = [{"nothing": 0} | ({"type": kind[1]} if kind else {})]
        keys = taken({table: content})
        if table == "camera":  # each kind of lens has a key of its own
            keys |= taken({table: {"nothing": 0, "type": "orthographic"}})
        assert {row[0] for row in listed[header][1]} == keys, header
    assert set(asked.values()) == taken({"nothing": {}})
    assert all(all(row) for _, rows in listed.values() for row in rows)


def taken(data: dict[str, object]) -> set[str]:
    """The keys that the reader of scene files names when it refuses the key `nothing`."""
    with pytest.raises(SceneError, match="known are") as refused:
        scene_from_dict(data)
    return set(str(refused.value).partition("known are ")[2].split(", "))


def test_examples_of_scene_files_are_read(tmp_path: Path) -> None:
    page = (DOCS / "scene-file.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert blocks
    for block in blocks:
        path = tmp_path / "scene.toml"
        path.write_text(block, encoding="utf-8")
        assert Scene.load(path).clip is not None


def test_the_scene_reference_reads_docstrings() -> None:
    meanings = scene_reference.attributes(Scene)
    assert meanings["clip"] == "The footage."
    assert meanings["background"] == meanings["camera"]
    assert "Raises" not in "".join(meanings.values())


def test_messages_are_found_in_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(messages, "ROOT", tmp_path)
    module = tmp_path / "module.py"
    module.write_text(
        '"""A docstring is no message at all."""\n'
        "def check(n, parser):\n"
        '    parser.add_argument("--n", help="The number of all things.")\n'
        '    if n < 0:\n        raise ValueError(f"{n}: is no number of things")\n'
        '    return f"There are {n} things " + "in the box."\n'
    )
    assert messages.messages(module) == ["…: is no number of things", "There are … things in the box."]


def test_every_package_has_its_topic() -> None:
    assert all(messages.all_messages().values())
    covered = [ROOT / folder for folders in messages.TOPICS.values() for folder in folders]
    packages = [path.parent for path in (ROOT / "engine" / "smokelift").glob("*/__init__.py")]
    assert [path.name for path in packages if path not in covered] == []


def test_sentences_of_the_troubleshooting_page_are_said() -> None:
    known = [words for listed in messages.all_messages().values() for words in map(WORDS.findall, listed)]
    said = SAID.findall((DOCS / "troubleshooting.md").read_text("utf-8"))
    assert len(said) > 40
    assert [quote for quote in said if not any(holds(words, WORDS.findall(quote)) for words in known)] == []


def holds(words: list[str], part: list[str]) -> bool:
    """Whether words hold others in one piece."""
    return any(words[first : first + len(part)] == part for first in range(len(words) - len(part) + 1))


def test_the_notebook_lists_every_experiment_with_its_question() -> None:
    lines = notebook.markdown().splitlines()
    assert len(lines) == len(list((DOCS / "experiments").glob("*.md")))
    assert all(line.rpartition(": ")[2] for line in lines)


def test_pages_name_scripts_that_make_something() -> None:
    made = {script for page in DOCS.glob("*.md") for script in MADE.findall(page.read_text(encoding="utf-8"))}
    assert made == {"command_reference", "constants", "messages", "notebook", "scene_reference"}


def test_the_command_reference_has_every_option() -> None:
    text = command_reference.markdown()
    for command, parser in command_reference.subcommands().items():
        for action in parser._actions:
            if action.option_strings and not isinstance(action, argparse._HelpAction):
                assert action.option_strings[-1] in text, (command, action.option_strings)


def test_every_argument_says_what_it_is_and_its_default_once() -> None:
    for command, parser in command_reference.subcommands().items():
        for action in parser._actions:
            assert action.help, (command, action.dest)
            if action.option_strings and isinstance(action.default, str | int | float) and action.default is not False:
                meaning = command_reference._meaning(action)
                said = re.findall(r"default(?: `|\)|:| \d|;)", meaning)
                assert action.default == argparse.SUPPRESS or len(said) == 1, (command, meaning)


def test_the_first_page_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 55


SECTIONS = re.split(r"\n(?=## )", (DOCS / "shooting.md").read_text(encoding="utf-8"))


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.splitlines()[0])
def test_figures_of_the_shooting_guide_stand_on_the_pages_that_it_links(section: str) -> None:
    sources = "".join((DOCS / link).read_text(encoding="utf-8") for link in re.findall(r"\]\(([\w/-]+\.md)\)", section))
    figures = set(re.findall(r"\d+\.\d+", section))
    assert {figure for figure in figures if not re.search(rf"(?<![\d.]){re.escape(figure)}(?!\d)", sources)} == set()
