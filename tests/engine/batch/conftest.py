"""Shots of an engine that computes nothing."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
import pytest

from smokelift.batch.shots import BatchShot

FAKE = Path(__file__).parent / "fake_engine.py"

SECONDS = 120.0
"""Longest wait for something, for a machine that does much else."""


@pytest.fixture
def fake() -> tuple[str, ...]:
    """The command of the fake engine."""
    return sys.executable, "-S", str(FAKE)


@pytest.fixture
def make_shot(tmp_path) -> Callable[..., BatchShot]:
    """Make a shot of so many frames; see `fake_engine`."""

    def make(
        name: str = "shot",
        frames: int = 3,
        seconds: float = 0.0,
        memory: int = 2**20,
        stubborn: bool = False,
        **ends: Any,
    ) -> BatchShot:
        path = tmp_path / f"{name}.task"
        task = {"frames": frames, "seconds": seconds, "memory": memory, "stubborn": stubborn}
        path.write_text(json.dumps({**task, "ends": {number[1:]: end for number, end in ends.items()}}))
        return BatchShot(name, path, (), tmp_path / "results")

    return make


@pytest.fixture
def until() -> Callable[[Callable[[], object]], None]:
    """Wait for something to become true."""

    def wait(true: Callable[[], object]) -> None:
        end = time.monotonic() + SECONDS
        while not true():
            assert time.monotonic() < end
            time.sleep(0.02)

    return wait


@pytest.fixture
def engines(tmp_path) -> Iterator[Callable[[], list[psutil.Process]]]:
    """Find the fake engines of this test's shots that are alive, whoever their parents are now."""

    def alive() -> list[psutil.Process]:
        found = []
        for process in psutil.process_iter():
            with suppress(psutil.Error):  # it has ended, or is another user's
                words = process.cmdline()  # none of one that has ended and that nobody waited for
                if str(FAKE) in words and any(word.startswith(str(tmp_path)) for word in words):
                    found.append(process)
        return found

    yield alive
    for process in alive():
        with suppress(psutil.Error):
            process.kill()


@pytest.fixture
def ledger() -> Callable[[BatchShot], list[int]]:
    """Read the frames of a shot that were finished, in the order in which they were."""
    return lambda shot: [int(line) for line in shot.file("ledger").read_text().split()]
