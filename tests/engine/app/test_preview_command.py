"""``smokelift preview``: where its files go."""

from __future__ import annotations

import shutil

from command_line import QUICK, command, events, names

from smokelift.footage.clip import Clip
from smokelift.footage.images import read_image

FILES = ["contact_sheet.png", "orbit.png", "preview.mp4", "strip.png"]


def test_preview_writes_pictures_and_video(finished, tmp_path, capsys) -> None:
    """All files, in the folder that was asked for; the paths are said."""
    out = tmp_path / "look"
    assert command("preview", finished, "--out", out, "--progress", "json") == 0
    assert names(out) == FILES
    done = events(capsys.readouterr().out)[-1]
    assert done["event"] == "done"
    assert sorted(done["files"]) == [str(out / name) for name in FILES]
    for name in FILES:
        assert name.endswith(".mp4") or read_image(out / name).max() > 0.5
    with Clip.open(out / "preview.mp4") as clip:
        assert len(clip) == 5


def test_preview_lies_in_the_sequence(finished, shot, tmp_path) -> None:
    """By default, so that two sequences in one folder keep their own; they can still be resumed."""
    for name in ("one", "two"):
        shutil.copytree(finished, tmp_path / name)
        assert command("preview", tmp_path / name) == 0
        assert names(tmp_path / name) == sorted([*names(finished), *FILES])
    assert command("reconstruct", shot, "--out", tmp_path / "two", "--npz", "--resume", *QUICK) == 0
