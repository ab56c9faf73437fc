"""The extension in the bpy wheels, each in an environment that has nothing else of what the engine needs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from dataclasses import dataclass

import pytest

from engine_wheels import GLIBC, ROOT, find_python
from tests.blender.setting import LIFECYCLE, pytest_words, run, shipped, unavailable, user_folder, variables

ADD_ONS_TESTS = ROOT / "tests" / "addon" / "inside"


@dataclass(frozen=True)
class Wheel:
    """A bpy wheel.

    Attributes
    ----------
    blender
        Its version.
    python
        The version of Python that it is for.
    numpy
        Requirement that gives it the numpy of the official build, not the newest that it accepts.
    """

    blender: str
    python: str
    numpy: str


WHEELS = [
    Wheel("4.5", "3.11", "numpy==1.26.*"),
    Wheel("5.0", "3.11", "numpy==1.26.*"),
    Wheel("5.2", "3.13", "numpy==2.2.*"),
]


@pytest.fixture(scope="module", params=WHEELS, ids=lambda wheel: f"bpy-{wheel.blender}")
def wheel(request) -> Wheel:
    """Each of the wheels."""
    return request.param


@pytest.fixture(scope="module")
def python(wheel) -> list[str]:
    """Words that start an interpreter with the wheel, its numpy, pytest and nothing else; offline where possible."""
    found = find_python(wheel.python)
    if found is None:
        unavailable(f"Python {wheel.python} was not found: install it, for example with pyenv install {wheel.python}")
    folder = ROOT / f".venv-bpy-{wheel.blender}"
    wanted = [f"bpy=={wheel.blender}.*", wheel.numpy, "pytest>=8"]
    stamp = folder / "wanted"
    if not stamp.is_file() or stamp.read_text() != " ".join(wanted):
        shutil.rmtree(folder, ignore_errors=True)
        subprocess.run([found, "-m", "venv", str(folder)], check=True)
        pip = [str(folder / "bin" / "python"), "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
        subprocess.run([*pip, *wanted], check=True)
        stamp.write_text(" ".join(wanted))
    return [*offline(), str(folder / "bin" / "python")]


def offline() -> list[str]:
    """Words before a command that take the network away from it; none where that is not allowed."""
    words = ["unshare", "--net"]
    try:
        allowed = subprocess.run([*words, "true"], capture_output=True).returncode == 0
    except OSError:
        allowed = False
    return words if allowed else []


def test_the_core_needs_no_newer_system_than_blender(wheel, tmp_path) -> None:
    """As the file itself says, whatever its wheel was called; its C++ library is inside it."""
    with zipfile.ZipFile(shipped(wheel.python)) as archive:
        (name,) = (name for name in archive.namelist() if re.search(r"/smokelift/_core\.[^/]+\.so$", name))
        core = archive.extract(name, tmp_path)
    words = ["readelf", "--wide", "--version-info", "--dynamic", core]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    needed = {tuple(map(int, version.split("."))) for version in re.findall(r"Name: GLIBC_([\d.]+)", said)}
    assert needed
    assert max(needed) <= tuple(map(int, GLIBC.split(".")))
    assert "libstdc++" not in said


def test_from_install_to_uninstall(wheel, python) -> None:
    """The whole story of `inside`."""
    folder = user_folder(f"bpy-{wheel.blender}")
    run([*python, "-m", "pytest", *pytest_words(LIFECYCLE, folder)], variables(folder, wheel.python))


def test_add_ons_own_tests_on_what_is_shipped(wheel, python) -> None:
    """What `make test` asks of the sources with one bpy, asked of the zip's files with every bpy."""
    folder = user_folder(f"bpy-{wheel.blender}")
    add_on = folder / "shipped" / "addon"  # the name that its tests import it by
    with zipfile.ZipFile(shipped(wheel.python)) as archive:
        archive.extractall(add_on)
    imports = [add_on.parent, add_on / f"python{wheel.python}"]
    environment = variables(folder, wheel.python) | {"PYTHONPATH": os.pathsep.join(map(str, imports))}
    for file in sorted(ADD_ONS_TESTS.glob("*.py")):
        if file.name != "conftest.py":  # each in a process of its own, as there
            run([*python, "-m", "pytest", *pytest_words(file, folder, [*imports, ROOT])], environment)
