"""Runs the tests of ``inside`` with the bpy of this Python, each file in a process of its own.

bpy is one per process and a crash of it ends the process; so it stays out of this one. A single file, or a test of
it, is run like any other: ``pytest tests/addon/inside/volume.py -k velocity``.

Those that reconstruct clips, simulate, export or render are left to ``make test-blender``, which runs every file in
every bpy: they take nearly as long as half of all other tests.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

INSIDE = Path(__file__).parent / "inside"
LONG = (
    "batch.py",
    "compositing.py",
    "directing.py",
    "export.py",
    "instances.py",
    "projection.py",
    "scene_file.py",
    "volume.py",
    "whole.py",
)
FILES = sorted({path.name for path in INSIDE.glob("*.py")} - {"conftest.py", *LONG})
SECONDS = 600


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="there is no bpy for this Python")
@pytest.mark.parametrize("name", FILES)
def test_inside(name) -> None:
    """Every test of a file passes."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(INSIDE / name)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert done.returncode == 0, done.stdout[-20_000:] + done.stderr[-2_000:]
