"""``smokelift check``."""

from __future__ import annotations

import json
import shutil

import pytest
from command_line import command, refused


@pytest.fixture
def copy(finished, tmp_path):
    """A finished sequence that may be damaged."""
    return shutil.copytree(finished, tmp_path / "smoke")


def test_a_whole_sequence_passes(finished, capsys) -> None:
    assert command("check", finished, "--progress", "json") == 0
    last = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (last["event"], last["frames"], last["empty"]) == ("done", 5, 0)


def test_a_damaged_frame_fails(copy, capsys) -> None:
    path = copy / "smoke_0003.npz"
    path.write_bytes(path.read_bytes()[:-1])
    assert "smoke_0003.npz" in refused(capsys, "check", copy)


def test_a_missing_frame_fails(copy, capsys) -> None:
    for path in copy.glob("smoke_0002.*"):
        path.unlink()
    assert refused(capsys, "check", copy).endswith("the file of frame 2 is missing.")


def test_an_unfinished_run_fails(copy, capsys) -> None:
    path = copy / "sequence.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "complete": False}))
    assert refused(capsys, "check", copy).endswith("has 5 finished frames and is no complete run; resume it.")
