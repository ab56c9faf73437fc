"""The engine's wheels are built in an environment that stays."""

from __future__ import annotations

import subprocess

import pytest

import engine_wheels


@pytest.fixture
def commands(monkeypatch) -> list[list[str]]:
    """What would be run."""
    seen: list[list[str]] = []
    monkeypatch.setattr(subprocess, "run", lambda command, **_: seen.append(command))
    return seen


def test_what_a_build_needs_is_installed_once_and_said(tmp_path, commands, capsys) -> None:
    """Again only where something else is needed, or for another Python."""
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
