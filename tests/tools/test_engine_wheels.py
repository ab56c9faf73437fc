"""The engine's wheels are built in an environment that stays."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

import engine_wheels


@pytest.fixture
def commands(monkeypatch) -> list[list[str]]:
    """What would be run."""
    seen: list[list[str]] = []
    monkeypatch.setattr(subprocess, "run", lambda command, **_: seen.append(command))
    return seen


def test_what_a_build_needs_is_installed_once_and_said(tmp_path, commands, capsys) -> None:
    folder = tmp_path / "env"
    folder.mkdir()
    programs = engine_wheels.build_environment("python3.11", folder)
    assert [command[1:3] for command in commands] == [["-m", "venv"], ["-m", "pip"]]
    assert "Installing what the build needs: scikit-build-core" in capsys.readouterr().out
    assert engine_wheels.build_environment("python3.11", folder) == programs
    assert len(commands) == 2
    assert capsys.readouterr().out == ""
    engine_wheels.build_environment("python3.13", folder)
    assert len(commands) == 4


def test_blenders_pythons_take_what_was_compiled_for_the_tests() -> None:
    assert engine_wheels.versions("3.13", blender=True) == ["3.13", "3.11"]
    assert engine_wheels.versions("3.12", blender=True) == ["3.11", "3.13"]
    assert engine_wheels.versions("3.12", blender=False) == ["3.12"]


@pytest.mark.parametrize("certified", [False, True])
def test_only_what_is_for_other_machines_is_checked_and_named_for_them(tmp_path, monkeypatch, certified) -> None:
    """Both come from the same compiled files, with the numerics of another Python where there are some."""
    seen: list[list[str]] = []

    def run(command, **_) -> subprocess.CompletedProcess:
        seen.append(command)
        if "wheel" in command:
            (Path(command[command.index("-w") + 1]) / "smokelift-1.0.0-cp313-cp313-linux_x86_64.whl").touch()
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(platform, "libc_ver", lambda: ("glibc", "2.36"))
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    engine_wheels.build(tmp_path / "bin", tmp_path / "compiled", tmp_path, Path("first"), certified=certified)
    assert {"-Ccmake.define.OLD_GLIBC=ON", "-Ccmake.define.NUMERICS_FROM=first"} <= set(seen[0])
    assert [command[1:4] for command in seen[1:]] == ([["-m", "auditwheel", "repair"]] if certified else [])


def test_a_core_that_needs_a_newer_system_is_refused(tmp_path, monkeypatch) -> None:
    def run(command, **_) -> subprocess.CompletedProcess:
        if "wheel" in command:
            (Path(command[command.index("-w") + 1]) / "smokelift-1.0.0-cp313-cp313-linux_x86_64.whl").touch()
        return subprocess.CompletedProcess(command, int("auditwheel" in command), stderr="too-recent symbols")

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(platform, "libc_ver", lambda: ("glibc", "2.43"))
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    with pytest.raises(engine_wheels.NotPortableError, match="too-recent symbols"):
        engine_wheels.build(tmp_path / "bin", tmp_path / "compiled", tmp_path, None, certified=True)
    assert not list(tmp_path.glob("*.whl"))


def test_an_environment_is_no_interpreter_of_its_own() -> None:
    """What was built by a Python serves all environments that are made of it, under whatever name they know it."""
    found = engine_wheels.find_python(f"{sys.version_info[0]}.{sys.version_info[1]}")
    assert found == os.path.realpath(sys._base_executable)
