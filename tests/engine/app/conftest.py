"""The tiny plume as a scene file, and as a sequence that the command line made of it."""

from pathlib import Path

import pytest
from command_line import QUICK

from smokelift import _core
from smokelift.app import cli
from smokelift.app.cli import main


@pytest.fixture(autouse=True)
def one_thread_of_a_command(monkeypatch) -> None:
    """A command that is given no number computes on one thread, as all tests do."""
    monkeypatch.setattr(cli, "set_threads", lambda count: _core.set_threads(count or 1))


@pytest.fixture(scope="session")
def shot(plume, tmp_path_factory) -> Path:
    """A complete scene file of the tiny plume."""
    path = tmp_path_factory.mktemp("shot") / "scene.toml"
    plume.scene.save(path)
    return path


@pytest.fixture(scope="session")
def finished(shot, tmp_path_factory) -> Path:
    """A finished sequence, made by the command line."""
    out = tmp_path_factory.mktemp("finished") / "smoke"
    assert main(["reconstruct", str(shot), "--out", str(out), "--npz", *QUICK]) == 0
    return out
