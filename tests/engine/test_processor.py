"""The core for newer processors is taken where there is one and the processor can run it."""

from __future__ import annotations

import pytest

from smokelift.processor import faster_core

NEWER = "processor\t: 0\nflags\t\t: fpu sse2 avx avx2 fma\nbugs\t\t:\nflags\t\t: fpu\n"


def test_a_processor_that_has_the_instructions_takes_the_faster_core(tmp_path) -> None:
    (tmp_path / "avx2").mkdir()
    (tmp_path / "cpuinfo").write_text(NEWER)
    assert faster_core(tmp_path, tmp_path / "cpuinfo") == str(tmp_path / "avx2")


@pytest.mark.parametrize(
    "told", [NEWER.replace(" fma", ""), NEWER.replace(" avx2", ""), "Features : asimd\n", "", None]
)
def test_any_other_processor_takes_the_core_that_runs_everywhere(tmp_path, told) -> None:
    """One that lacks an instruction set, one of another kind, and one that nothing is said of."""
    (tmp_path / "avx2").mkdir()
    if told is not None:
        (tmp_path / "cpuinfo").write_text(told)
    assert faster_core(tmp_path, tmp_path / "cpuinfo") is None


def test_a_build_without_the_faster_core_is_as_good(tmp_path) -> None:
    """It says nothing."""
    (tmp_path / "cpuinfo").write_text(NEWER)
    assert faster_core(tmp_path, tmp_path / "cpuinfo") is None
