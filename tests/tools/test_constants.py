"""Tests of the table of constants: each has its meaning, and what is set by hand names what would move it."""

import contextlib
import io
import re
import runpy
import sys

import pytest

import constants
from tests.test_docs import ENGINE, ROOT

COMMANDS = sorted(
    set(
        re.findall(r"python -m (benchmarks[\w.]*)((?: [^`]*)?)`", " ".join(" ".join(constants.SWEEPS.values()).split()))
    )
)


def test_every_constant_has_a_meaning() -> None:
    found = [row for rows in constants.packages().values() for row in rows]
    assert len(found) > 550
    assert [(row.module, row.name) for row in found if not row.meaning] == []


def test_every_package_with_constants_set_by_hand_says_what_would_move_them() -> None:
    found = constants.packages().items()
    assert {name for name, rows in found if any(row.set_by == constants.BY_HAND for row in rows)} == set(
        constants.SWEEPS
    )


def test_packages_are_those_of_the_engine_its_core_and_what_decides_in_the_addon() -> None:
    found = constants.packages()
    assert set(found) - {path.name for path in ENGINE.iterdir()} == {"addon", "cpp"}
    assert {"MIN_OPACITY", "TOLERANCE", "PATIENCE_FAR"} <= {row.name for row in found["cpp"]}
    names = {row.name for row in found["addon"]}
    assert {"MATCHES", "GOOD_DEGREES", "SLOWEST, FASTEST"} <= names
    assert not {"HOME", "PRESETS", "SINCE_5", "NEW_WIDTH"} & names


def test_constants_of_the_core_have_the_comments_above_and_beside_them(tmp_path) -> None:
    source = tmp_path / "light.h"
    source.write_text(
        "constexpr float TOLERANCE = 5e-4f, MIN[2] = {0, 1}; // of light,\n"
        "                                                    // relative (measured)\n"
        "constexpr int BARE = 1;\n"
        "// Orders (docs/experiments/scattering.md).\n"
        "constexpr int FIRST = Orders::FIRST, LAST = 9;\n"
        "    static constexpr std::size_t ROWS = 4; // at once\n"
        'static constexpr auto name = const_name("Array1");\n'
        "int f() {\n    constexpr int INSIDE = 3;\n    return INSIDE;\n}\n"
    )
    assert [row[1:] for row in constants.constants(source)] == [
        ("TOLERANCE", "5e-4f", "of light, relative (measured)", "measured"),
        ("MIN", "{0, 1}", "of light, relative (measured)", "measured"),
        ("BARE", "1", "", constants.BY_HAND),
        ("LAST", "9", "Orders (docs/experiments/scattering.md).", "[scattering](experiments/scattering.md)"),
        ("ROWS", "4", "Orders (docs/experiments/scattering.md). at once", "[scattering](experiments/scattering.md)"),
    ]


@pytest.mark.parametrize(("module", "words"), COMMANDS, ids=[module for module, _ in COMMANDS])
@pytest.mark.filterwarnings("ignore:.*found in sys.modules:RuntimeWarning")
def test_a_sweep_has_the_options_that_are_said(module, words, monkeypatch) -> None:
    monkeypatch.setattr(sys, "argv", [module, "--help"])
    said = io.StringIO()
    with contextlib.redirect_stdout(said), pytest.raises(SystemExit) as ended:
        runpy.run_module(module, run_name="__main__")
    assert ended.value.code == 0
    assert set(re.findall(r"--[a-z]+", words)) <= set(re.findall(r"--[a-z]+", said.getvalue()))


def test_a_constant_without_a_meaning_or_a_source_is_seen(tmp_path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        '"""A module."""\n'
        'NAME = "none"\n'
        "BARE = 2.0\n"
        'GIVEN, OTHER = 1, 2\n"""Voxels (docs/experiments/wander.md), and (by definition) pixels."""\n'
        'WEIGHT: float = -0.5\n"""Weight (Author, "Title", 2011)."""\n'
        "SECONDS = 2  # between two readings (measured)\n"
        "def f() -> int:\n    INSIDE = 3\n    return INSIDE\n"
    )
    assert [(row.name, row.value, row.meaning != "", row.set_by) for row in constants.constants(module)] == [
        ("BARE", "2.0", False, "by hand"),
        ("GIVEN, OTHER", "1, 2", True, "[wander](experiments/wander.md); by definition"),
        ("WEIGHT", "-0.5", True, 'Author, "Title", 2011'),
        ("SECONDS", "2", True, "measured"),
    ]


def test_a_module_may_name_the_source_of_its_constants(tmp_path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        '"""Costs.\n\nConstants that say no other source:\ndocs/experiments/memory-and-time.md.\n"""\n'
        'A = 1\n"""Seconds."""\nB = 2\n"""Seconds (by hand)."""\n'
    )
    assert [row.set_by for row in constants.constants(module)] == [
        "[memory-and-time](experiments/memory-and-time.md)",
        constants.BY_HAND,
    ]


def test_the_table_of_a_package_has_its_sweep_above() -> None:
    page = constants.markdown()
    velocity = page.partition("## velocity\n")[2]
    assert velocity.index("benchmarks.velocity") < velocity.index("| module |")
    assert "docs/" not in page and str(ROOT) not in page
