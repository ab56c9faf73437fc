"""``smokelift continue``: what it writes, says and refuses."""

from __future__ import annotations

from command_line import command, events, names, refused


def test_a_clip_goes_on(finished, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    words = ("continue", finished, "--out", out, "--frames", 3, "--npz", "--fade", 1, "--wind", 0.2, -0.1, 0)
    assert command(*words, "--progress", "json") == 0
    said = events(capsys.readouterr().out)
    assert said[-1]["event"] == "done"
    assert said[-1]["frames"] == len([event for event in said if event["event"] == "frame"])
    assert len([name for name in names(out) if name.endswith(".npz")]) == said[-1]["frames"]
    assert command("render", out, "--frame", said[-1]["frames"], "--out", tmp_path / "last.png") == 0


def test_mistakes_end_in_one_sentence(finished, tmp_path, capsys) -> None:
    start = ("continue", finished, "--out", tmp_path / "out", "--npz")
    assert "--frames 0" in refused(capsys, *start, "--frames", 0)
    assert "--fade 4" in refused(capsys, *start, "--frames", 3, "--fade", 4)
    assert "radius" in refused(capsys, *start, "--frames", 3, "--ball", 0, 0, 1, -1)
    assert "no voxel" in refused(capsys, *start, "--frames", 3, "--box", 50, 50, 50, 60, 60, 60)
    assert "cannot go on from frame 77" in refused(capsys, *start, "--frames", 3, "--start", 77)
    assert "the sequence itself" in refused(capsys, "continue", finished, "--out", finished, "--frames", 3)
    assert "holds no sequence" in refused(capsys, "continue", tmp_path, "--out", tmp_path / "out", "--frames", 3)
    assert not (tmp_path / "out").exists()
