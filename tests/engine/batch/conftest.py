"""Shots of an engine that computes nothing."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from smokelift.batch.shots import BatchShot

FAKE = Path(__file__).parent / "fake_engine.py"


@pytest.fixture
def fake() -> tuple[str, ...]:
    """The command of the fake engine."""
    return sys.executable, "-S", str(FAKE)


@pytest.fixture
def make_shot(tmp_path: Path) -> Callable[..., BatchShot]:
    """Make a shot of so many frames; see `fake_engine`."""

    def make(name: str = "shot", frames: int = 3, seconds: float = 0.0, memory: int = 2**20, **ends: Any) -> BatchShot:
        path = tmp_path / f"{name}.task"
        task = {"frames": frames, "seconds": seconds, "memory": memory}
        path.write_text(json.dumps({**task, "ends": {number[1:]: end for number, end in ends.items()}}))
        return BatchShot(name, path, (), tmp_path / "results")

    return make


@pytest.fixture
def ledger() -> Callable[[BatchShot], list[int]]:
    """Read the frames of a shot that were finished, in the order in which they were."""
    return lambda shot: [int(line) for line in shot.file("ledger").read_text().split()]
