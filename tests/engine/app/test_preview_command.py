"""``smokelift preview``: where its files go."""

from __future__ import annotations

import shutil

from command_line import QUICK, command, events, names

from smokelift.footage.clip import Clip
from smokelift.footage.images import read_image


def test_preview_writes_sheet_and_video(finished, tmp_path, capsys) -> None:
    """Both files, in the folder that was asked for; the paths are said."""
    out = tmp_path / "look"
    assert command("preview", finished, "--out", out, "--progress", "json") == 0
    assert names(out) == ["contact_sheet.png", "preview.mp4"]
    done = events(capsys.readouterr().out)[-1]
    assert done["event"] == "done"
    assert done["files"] == [str(out / "contact_sheet.png"), str(out / "preview.mp4")]
    assert read_image(out / "contact_sheet.png").max() > 0.5
    with Clip.open(out / "preview.mp4") as clip:
        assert len(clip) == 5


def test_preview_lies_in_the_sequence(finished, shot, tmp_path) -> None:
    """By default, so that two sequences in one folder keep their own; they can still be resumed."""
    for name in ("one", "two"):
        shutil.copytree(finished, tmp_path / name)
        assert command("preview", tmp_path / name) == 0
        assert names(tmp_path / name) == sorted([*names(finished), "contact_sheet.png", "preview.mp4"])
    assert command("reconstruct", shot, "--out", tmp_path / "two", "--npz", "--resume", *QUICK) == 0
