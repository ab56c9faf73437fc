"""A short campaign of damaged files against the command line, and that the campaign itself sees what it must."""

from __future__ import annotations

import os
import signal
import sys
import time

import pytest

from benchmarks.stability.__main__ import failures, main
from benchmarks.stability.cases import CLASSES
from benchmarks.stability.forked import Ended, Limits, run
from benchmarks.stability.judge import verdict
from benchmarks.stability.shot import TinyShot, tiny_shot

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs fork")

FOUND = {
    "clip": [24],  # no decoder
    "picture": [5],  # OpenEXR speaks for itself
    "NumPy twin": [23],  # negative densities
    "resume.npz": [3, 42],  # squares that overflow, text in place of numbers
}
"""Cases that failed once."""


@pytest.fixture(scope="module")
def shot(tmp_path_factory) -> TinyShot:
    return tiny_shot(tmp_path_factory.mktemp("stability"))


@pytest.mark.parametrize("name", CLASSES)
def test_damaged_files_end_in_one_line(shot, tmp_path, name) -> None:
    statuses, failed = failures(shot, name, 3, tmp_path)
    assert failed == []
    assert sum(statuses.values()) == 3


@pytest.mark.parametrize(("name", "number"), [(name, n) for name, numbers in FOUND.items() for n in numbers])
def test_what_failed_once_fails_no_more(shot, tmp_path, name, number) -> None:
    assert failures(shot, name, 1, tmp_path, first=number)[1] == []


def fails(words):
    """Ends as no command may."""
    kind = words[0]
    if kind == "raise":
        raise AssertionError("a bug")
    if kind == "signal":
        os.kill(os.getpid(), signal.SIGSEGV)
    if kind == "hang":
        time.sleep(60)
    if kind == "lines":
        print("one\ntwo", file=sys.stderr)
    return {"status": 1, "lines": 2}.get(kind, 0)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [("raise", "traceback"), ("signal", "signal"), ("hang", "hung"), ("status", "status"), ("lines", "not one line")],
)
def test_the_judge_sees_every_failure(tmp_path, kind, wrong) -> None:
    ended = run(fails, [kind], tmp_path, Limits(seconds=0.5))
    assert verdict(ended, {}, {}, "new") == wrong


def test_the_judge_sees_other_files() -> None:
    ended = Ended(0, "", "", hung=False)
    assert verdict(ended, {"a": (1, 1)}, {"a": (1, 1), "new.png": (1, 1)}, "new") == ""
    assert verdict(ended, {"a": (1, 1)}, {"a": (2, 1)}, "new") == "other files"
    assert verdict(ended, {"a": (1, 1)}, {}, "new") == "other files"


def test_the_table(tmp_path, capsys) -> None:
    assert main([str(tmp_path), "--cases", "1", "--classes", "NumPy twin"]) == 0
    assert "| NumPy twin | 1 |" in capsys.readouterr().out
