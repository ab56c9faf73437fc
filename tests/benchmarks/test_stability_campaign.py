"""A case of every class of damaged files and failing systems, and that the campaign itself sees what it must.

`make stability` runs twenty of every class, from the same numbers on.
"""

import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from benchmarks.stability.__main__ import failures
from benchmarks.stability.cases import DAMAGED, EXTRACTED
from benchmarks.stability.environments import Failure, lacking
from benchmarks.stability.forked import Ended, run, verdict
from benchmarks.stability.recovery import recovered
from benchmarks.stability.shot import TinyShot, tiny_shot

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs fork")

FOUND = {
    "clip": [24],  # no decoder
    "picture": [5],  # OpenEXR speaks for itself
    "NumPy twin": [23],  # negative densities
    "resume.npz": [3, 42],  # squares that overflow, text in place of numbers
}
"""Cases that failed once."""

KILLED_BEFORE_AN_INDEX = 314
"""Another one."""


@pytest.fixture(scope="module")
def shot(tmp_path_factory) -> TinyShot:
    return tiny_shot(tmp_path_factory.mktemp("stability"))


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder that every user can reach."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        yield folder


@pytest.mark.parametrize(
    ("name", "number"),
    [*((name, 0) for name in (*DAMAGED, *EXTRACTED)), *((name, n) for name, numbers in FOUND.items() for n in numbers)],
)
def test_damaged_files_end_in_one_line(shot, tmp_path, name, number) -> None:
    statuses, failed = failures(shot, name, 1, tmp_path, first=number)
    assert failed == []
    assert sum(statuses.values()) == 1


@pytest.mark.parametrize("name", ["full disk", "small memory", "cancelled", "killed"])
def test_a_run_goes_on_when_the_system_is_well_again(shot, open_folder, name) -> None:
    if reason := lacking(name, open_folder):
        pytest.skip(reason)
    first = KILLED_BEFORE_AN_INDEX if name == "killed" else 0
    statuses, failed = failures(shot, name, 1, open_folder, first)
    assert failed == []
    assert sum(statuses.values()) == 1
    assert name != "killed" or statuses[-signal.SIGKILL]


def losing(name, tell):
    """An environment in which a run loses a file that it has written, or more."""

    @contextmanager
    def environment(out, random):
        yield Failure(mend=lambda: tell(out / name))

    return environment


@pytest.mark.parametrize(
    ("name", "tell", "wrong"),
    [
        ("smoke_0002.npz", lambda path: shutil.copy(path.with_name("smoke_0001.npz"), path), "damaged"),
        (".", lambda path: shutil.rmtree(path), "lost"),
        ("notes.txt", lambda path: path.write_text("mine"), "cannot go on"),
        ("../notes.txt", lambda path: path.write_text("mine"), "other files"),
    ],
)
def test_what_is_lost_is_seen(shot, tmp_path, name, tell, wrong) -> None:
    assert recovered(losing(name, tell), shot, tmp_path / "case", np.random.default_rng(1))[1].startswith(wrong)


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
    ended = run(fails, [kind], tmp_path, seconds=0.5)
    assert verdict(ended, {}, {}, "new") == wrong


def test_the_judge_sees_other_files() -> None:
    ended = Ended(0, "", "", hung=False)
    assert verdict(ended, {"a": (1, 1)}, {"a": (1, 1), "new.png": (1, 1)}, "new") == ""
    assert verdict(ended, {"a": (1, 1)}, {"a": (2, 1)}, "new") == "other files"
    assert verdict(ended, {"a": (1, 1)}, {}, "new") == "other files"
