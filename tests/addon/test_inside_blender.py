"""Runs the tests of ``inside`` with the bpy of this Python, in one process: to start it takes as long as a file.

bpy is one per process and a crash of it ends the process; so it stays out of this one. A single file, or a test of
it, is run like any other: ``pytest tests/addon/inside/scene/volume.py -k velocity``.

Those that reconstruct clips, simulate, export or render are left to ``make test-blender``, which runs every file in
every bpy: they take nearly as long as half of all other tests.
"""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

INSIDE = Path(__file__).parent / "inside"
LONG = ["command_line", "compositing", "directing", "export", "plate", "scene_file", "volume", "whole"]
FILES = sorted(path for path in INSIDE.rglob("*.py") if path.stem not in ("conftest", *LONG))
SECONDS = 600


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="there is no bpy for this Python")
def test_inside() -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *map(str, FILES)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert done.returncode == 0, done.stdout[-20_000:] + done.stderr[-2_000:]
