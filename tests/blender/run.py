"""`make test-blender`: the extension's zip in the Blenders that it is for.

    run.py ZIP

First in the bpy wheels, each in an environment that has nothing else of what the engine needs; then in a real Blender
from Debian, without a window and with one. Everything runs without a network where the system lets us take it away.
Pictures and figures stay in build/test-blender.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from engine_wheels import ROOT, find_python
from PIL import Image

HERE = Path(__file__).parent
WORK = ROOT / "build" / "test-blender"
INSIDE = HERE / "inside" / "lifecycle.py"

DEBIAN_ROOT = Path(os.environ.get("SMOKELIFT_BLENDER_ROOT", Path.home() / ".cache" / "smokelift-tests" / "trixie"))
"""Where the real Blender is kept; 1.2 GB."""

REQUIRED = bool(os.environ.get("SMOKELIFT_REQUIRE_BLENDER"))
"""Whether a Blender that cannot be had is a failure; else it is said and left out."""


class Unavailable(RuntimeError):  # noqa: N818
    """Something that this machine does not have, and what to do about it."""


@dataclass(frozen=True)
class Wheel:
    """A bpy wheel to test in.

    Attributes
    ----------
    blender
        Its version.
    python
        The version of Python that it is for.
    numpy
        Requirement that gives it the numpy of the official build, which may be older than what pip would choose.
    """

    blender: str
    python: str
    numpy: str


WHEELS = (Wheel("4.5", "3.11", "numpy==1.26.*"), Wheel("5.0", "3.11", "numpy==1.26.*"), Wheel("5.2", "3.13", "numpy==2.2.*"))


def main() -> int:
    """Run all parts; returns the exit status."""
    zipped = Path(sys.argv[1]).resolve()
    failed = []
    for wheel in WHEELS:
        failed += part(f"bpy {wheel.blender}", test_wheel, wheel, zipped)
    failed += part("Debian's Blender: get it", make_root)
    if (DEBIAN_ROOT / "usr/bin/blender").exists():
        failed += part("Debian's Blender: from install to uninstall", test_root, zipped)
        failed += part("Debian's Blender: its command line", test_command, zipped)
        failed += part("Debian's Blender: its window", test_window)
    if failed:
        print(f"test-blender: failed: {', '.join(failed)}", file=sys.stderr)
    return bool(failed)


def part(name: str, test: Any, *arguments: Any) -> list[str]:
    """Run one part, say how long it took, and return its name if it failed."""
    print(f"== {name}", flush=True)
    began = time.monotonic()
    try:
        test(*arguments)
        outcome = "passed"
    except Unavailable as reason:
        outcome = f"{'failed' if REQUIRED else 'skipped'}: {reason}"
    except (AssertionError, subprocess.CalledProcessError, OSError) as error:
        outcome = f"failed: {error}"
    print(f"== {name}: {outcome} ({time.monotonic() - began:.0f} s)", flush=True)
    return [name] if outcome.startswith("failed") else []


# the bpy wheels


def test_wheel(wheel: Wheel, zipped: Path) -> None:
    """The story of `inside`, then the add-on's own tests on the installed files instead of the sources."""
    python = environment(wheel)
    resources = user_folder(f"bpy-{wheel.blender}")
    run([*offline(), python, *pytest_words(INSIDE, resources)], resources, zipped)


def environment(wheel: Wheel) -> str:
    """An interpreter with a bpy wheel, its numpy and pytest, and nothing else."""
    found = find_python(wheel.python)
    if found is None:
        raise Unavailable(f"Python {wheel.python} was not found: install it (pyenv install {wheel.python}).")
    folder = ROOT / f".venv-bpy-{wheel.blender}"
    wanted = [f"bpy=={wheel.blender}.*", wheel.numpy, "pytest>=8"]
    stamp = folder / "wanted"
    if not stamp.is_file() or stamp.read_text() != " ".join(wanted):
        shutil.rmtree(folder, ignore_errors=True)
        subprocess.run([found, "-m", "venv", str(folder)], check=True)
        pip = [str(folder / "bin/python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, *wanted], check=True)
        stamp.write_text(" ".join(wanted))
    return str(folder / "bin/python")


def offline() -> list[str]:
    """Words before a command that take the network away from it, if the system lets us."""
    words = ["unshare", "--net"]
    try:
        allowed = subprocess.run([*words, "true"], capture_output=True).returncode == 0
    except OSError:
        allowed = False
    if not allowed:
        print("   with the network on: it takes root and Linux to switch it off for a test")
    return words if allowed else []


def user_folder(name: str) -> Path:
    """A new folder for a Blender's settings and extensions; without these in it Blender would use the user's own."""
    folder = WORK / name
    shutil.rmtree(folder, ignore_errors=True)
    for part_of in ("config", "scripts", "extensions", "datafiles"):
        (folder / part_of).mkdir(parents=True)
    return folder


def pytest_words(file: Path, folder: Path, path: Sequence[Path] = (ROOT,)) -> list[str]:
    """Arguments for pytest: a file, and where to import from."""
    words = ["-q", "-p", "no:cacheprovider", "-c", str(ROOT / "pyproject.toml"), "--basetemp", str(folder / "tmp")]
    return [*words, "-o", f"pythonpath={' '.join(map(str, path))}", str(file)]


def variables(folder: Path, zipped: Path) -> dict[str, str]:
    """What the tests in a Blender need to know."""
    return {
        "BLENDER_USER_RESOURCES": str(folder),
        "SMOKELIFT_ZIP": str(zipped),
        "PYTHONDONTWRITEBYTECODE": "1",
    }


# the real Blender


def make_root() -> None:
    """Build the Debian root, unless it is there already, made by the same script."""
    script = HERE / "root" / "make.sh"
    stamp = DEBIAN_ROOT / "made-by"
    recipe = hashlib.sha256(script.read_bytes()).hexdigest()
    if stamp.is_file() and stamp.read_text() == recipe:
        return
    if not sys.platform.startswith("linux") or os.geteuid() != 0:
        raise Unavailable("it takes root on Linux to build a Debian root and to enter it: run make test-blender as root.")
    if shutil.which("mmdebstrap") is None:
        if shutil.which("apt-get") is None:
            raise Unavailable("mmdebstrap was not found: install it, and run make test-blender again.")
        subprocess.run(["apt-get", "update", "-q"], check=True, stdout=subprocess.DEVNULL)
        install = ["apt-get", "install", "-yq", "--no-install-recommends", "mmdebstrap"]
        subprocess.run(install, check=True, stdout=subprocess.DEVNULL)
    done = subprocess.run([str(script), str(DEBIAN_ROOT)], capture_output=True, text=True)
    if done.returncode != 0:
        raise Unavailable(f"the Debian root could not be built: {done.stderr.strip()[-2000:]}")
    stamp.write_text(recipe)


def in_root(folder: Path, *command: str, **extra: str) -> subprocess.CompletedProcess[str]:
    """Run a command in the Debian root, offline, with the repository at its own path; prints what it said if it fails."""
    settings = [f"{key}={value}" for key, value in {"BLENDER_USER_RESOURCES": str(folder), **extra}.items()]
    enter = [str(HERE / "root" / "enter.sh"), str(DEBIAN_ROOT), str(ROOT), "env", *settings, *command]
    done = subprocess.run(enter, capture_output=True, text=True)
    ...
