"""The extension in the bpy wheels, each in an environment that has nothing else of what the engine needs."""

import os
import re
import shutil
import subprocess
import zipfile

import pytest

from engine_wheels import GLIBC, ROOT, find_python
from tests.blender.setting import LIFECYCLE, pytest_words, run, shipped, unavailable, user_folder, variables

ADD_ONS_TESTS = ROOT / "tests" / "addon" / "inside"


def offline() -> list[str]:
    """Words before a command that take the network away from it; none where that is not allowed."""
    words = ["unshare", "--net"]
    try:
        allowed = subprocess.run([*words, "true"], capture_output=True).returncode == 0
    except OSError:
        allowed = False
    return words if allowed else []


class InWheel:
    """The tests in a wheel, which one process runs: it makes the wheel's environment."""

    blender: str  # the wheel's version
    python: str  # the version of Python that it is for
    numpy: str  # requirement that gives it the numpy of the official build, not the newest that it accepts

    @pytest.fixture(scope="class")
    @classmethod
    def interpreter(cls) -> list[str]:
        """Words that start an interpreter with the wheel, its numpy, pytest and nothing else; offline if possible."""
        found = find_python(cls.python)
        if found is None:
            unavailable(f"Python {cls.python} was not found: install it, for example with pyenv install {cls.python}")
        folder = ROOT / f".venv-bpy-{cls.blender}"
        wanted = [f"bpy=={cls.blender}.*", cls.numpy, "pytest>=8"]
        stamp = folder / "wanted"
        if not stamp.is_file() or stamp.read_text() != " ".join(wanted):
            shutil.rmtree(folder, ignore_errors=True)
            subprocess.run([found, "-m", "venv", str(folder)], check=True)
            pip = [str(folder / "bin" / "python"), "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
            subprocess.run([*pip, *wanted], check=True)
            stamp.write_text(" ".join(wanted))
        return [*offline(), str(folder / "bin" / "python")]

    def test_the_core_needs_no_newer_system_than_blender(self, tmp_path) -> None:
        with zipfile.ZipFile(shipped(self.python)) as archive:
            (name,) = (name for name in archive.namelist() if re.search(r"/smokelift/_core\.[^/]+\.so$", name))
            core = archive.extract(name, tmp_path)
        words = ["readelf", "--wide", "--version-info", "--dynamic", core]
        said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        needed = {tuple(map(int, version.split("."))) for version in re.findall(r"Name: GLIBC_([\d.]+)", said)}
        assert needed
        assert max(needed) <= tuple(map(int, GLIBC.split(".")))
        assert "libstdc++" not in said

    def test_from_install_to_uninstall(self, interpreter) -> None:
        folder = user_folder(f"bpy-{self.blender}")
        run([*interpreter, "-m", "pytest", *pytest_words(LIFECYCLE, folder)], variables(folder, self.python))

    def test_add_ons_own_tests_on_what_is_shipped(self, interpreter) -> None:
        """What `make test` asks of the sources with one bpy, asked of the zip's files with every bpy."""
        folder = user_folder(f"bpy-{self.blender}")
        add_on = folder / "shipped" / "addon"  # the name that its tests import it by
        with zipfile.ZipFile(shipped(self.python)) as archive:
            archive.extractall(add_on)
        imports = [add_on.parent, add_on / f"python{self.python}"]
        environment = variables(folder, self.python) | {"PYTHONPATH": os.pathsep.join(map(str, imports))}
        for file in sorted(ADD_ONS_TESTS.rglob("*.py")):
            if file.name != "conftest.py":  # each in a process of its own, as there
                run([*interpreter, "-m", "pytest", *pytest_words(file, folder, [*imports, ROOT])], environment)


class TestBpy45(InWheel):
    blender, python, numpy = "4.5", "3.11", "numpy==1.26.*"


class TestBpy50(InWheel):
    blender, python, numpy = "5.0", "3.11", "numpy==1.26.*"


class TestBpy52(InWheel):
    blender, python, numpy = "5.2", "3.13", "numpy==2.2.*"
