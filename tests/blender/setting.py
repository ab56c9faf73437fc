"""Where the tests in Blenders find things, and how they are run there."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from engine_wheels import ROOT
from extension_products import NAMED

DIST = ROOT / "dist"
WORK = ROOT / "build" / "test-blender"
"""Everything that the tests leave; pictures and figures are for the eye."""

LONGEST = 1200
"""Seconds that a command may take: a Blender that hangs is a fault, not a reason to wait."""

LIFECYCLE = ROOT / "tests" / "blender" / "inside" / "lifecycle.py"


def shipped(python: str, name: str = "smokelift") -> Path:
    """The extension's zip for this system and a version of Python."""
    (found,) = DIST.glob(f"{name}-*-{NAMED[python]}-linux_x64.zip")
    return found


def unavailable(reason: str) -> None:
    """Leave a test out, with the reason; fail it where a Blender that cannot be had is not to be excused."""
    if os.environ.get("SMOKELIFT_REQUIRE_BLENDER"):
        pytest.fail(reason)
    pytest.skip(reason)


def user_folder(name: str) -> Path:
    """A new folder for a Blender's settings and extensions; without these in it Blender would use the user's own."""
    folder = WORK / name
    shutil.rmtree(folder, ignore_errors=True)
    for within in ("config", "scripts", "extensions", "datafiles"):
        (folder / within).mkdir(parents=True)
    return folder


def variables(folder: Path, python: str) -> dict[str, str]:
    """What a Blender and the tests in it need to know."""
    zips = {"SMOKELIFT_ZIP": str(shipped(python)), "SMOKELIFT_GPU_ZIP": str(shipped(python, "smokelift_gpu"))}
    return {"BLENDER_USER_RESOURCES": str(folder), "PYTHONDONTWRITEBYTECODE": "1", **zips}


def pytest_words(file: Path, folder: Path, imports: Sequence[Path] = (ROOT,)) -> list[str]:
    """Arguments for the pytest in a Blender: what to run, where to leave files, and where to import from."""
    words = ["-q", "-p", "no:cacheprovider", "-c", str(ROOT / "pyproject.toml"), "--basetemp", str(folder / "tmp")]
    return [*words, "-o", f"pythonpath={' '.join(map(str, imports))}", str(file)]


def run(command: Sequence[str], environment: dict[str, str] | None = None) -> str:
    """Run a command to its good end and return what it said."""
    # a pytest in a Blender is nobody's worker, as the one that runs it may be
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_XDIST")}
    # from elsewhere than the sources, which would be imported by accident
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    done = subprocess.run(command, cwd=WORK, env=inherited | (environment or {}), timeout=LONGEST, **pipes)
    assert done.returncode == 0, f"status {done.returncode} of {' '.join(command)}\n{done.stdout[-20_000:]}"
    return done.stdout
