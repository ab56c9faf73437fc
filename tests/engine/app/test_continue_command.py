"""``smokelift continue``: what it writes, says and refuses."""

from __future__ import annotations

import shutil

import numpy as np
from command_line import command, events, names, refused

from smokelift.report import cost


def test_continue_adds_frames(finished, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    words = ("continue", finished, "--out", out, "--frames", 3, "--npz", "--fade", 1, "--wind", 0.2, -0.1, 0)
    words += ("--turbulence", 0.3, 0.6, 1, "--turbulence", 0.1, 0.9, 2, "--closed", "z-", "x+")
    assert command(*words, "--progress", "json") == 0
    said = events(capsys.readouterr().out)
    assert said[-1]["event"] == "done"
    assert said[-1]["frames"] == len([event for event in said if event["event"] == "frame"])
    assert len([name for name in names(out) if name.endswith(".npz")]) == said[-1]["frames"]
    assert command("render", out, "--frame", said[-1]["frames"], "--out", tmp_path / "last.png") == 0


def test_one_sentence_says_that_the_box_cannot_grow(finished, tmp_path, capsys, monkeypatch) -> None:
    """For want of room or of memory; a run that goes on keeps the room that it has."""

    def said(*words: object) -> list[str]:
        start = ("continue", finished, "--out", tmp_path / "out", "--npz", "--frames", 8, "--wind", 6, 0, 0)
        assert command(*start, *words, "--progress", "json") == 0
        return [event["text"] for event in events(capsys.readouterr().out) if event["event"] == "note"]

    (sentence,) = said("--room", 1)
    assert "dissolves" in sentence and "more room than 1" in sentence
    shutil.rmtree(tmp_path / "out")
    monkeypatch.setattr(cost, "memory_free", lambda: 0)
    assert "grows to 1 times" in said()[0]
    monkeypatch.undo()
    assert said("--resume") == []


def test_mistakes_end_in_one_sentence(finished, tmp_path, capsys) -> None:
    start = ("continue", finished, "--out", tmp_path / "out", "--npz")
    assert "--frames 0" in refused(capsys, *start, "--frames", 0)
    assert "--fade 4" in refused(capsys, *start, "--frames", 3, "--fade", 4)
    assert "radius" in refused(capsys, *start, "--frames", 3, "--ball", 0, 0, 1, -1)
    assert "no voxel" in refused(capsys, *start, "--frames", 3, "--box", 50, 50, 50, 60, 60, 60)
    assert "--room 0.5" in refused(capsys, *start, "--frames", 3, "--room", 0.5)
    assert "--turbulence 1 0 0" in refused(capsys, *start, "--frames", 3, "--turbulence", 1, 0, 0)
    assert "--turbulence 1 1 0.5" in refused(capsys, *start, "--frames", 3, "--turbulence", 1, 1, 0.5)
    assert "too small for voxels" in refused(capsys, *start, "--frames", 3, "--turbulence", 1, 0.001, 0)
    assert "cannot go on from frame 77" in refused(capsys, *start, "--frames", 3, "--start", 77)
    assert "the sequence itself" in refused(capsys, "continue", finished, "--out", finished, "--frames", 3)
    assert "holds no sequence" in refused(capsys, "continue", tmp_path, "--out", tmp_path / "out", "--frames", 3)
    assert not (tmp_path / "out").exists()


def test_a_mesh_is_an_obstacle(finished, tmp_path, capsys) -> None:
    start = ("continue", finished, "--out", tmp_path / "out", "--npz", "--frames", 1)
    assert "mesh.stl: is no file" in refused(capsys, *start, "--mesh", tmp_path / "mesh.stl")
    corners = np.array([(99, 9, 9), (98, 9, 9), (99, 8, 9), (99, 9, 8)], np.float32)
    with (tmp_path / "mesh.stl").open("wb") as file:
        file.write(bytes(80) + (4).to_bytes(4, "little"))
        for number in range(4):
            file.write(bytes(12) + np.delete(corners, number, axis=0).tobytes() + bytes(2))
    assert "no voxel" in refused(capsys, *start, "--mesh", tmp_path / "mesh.stl")
    assert "no such files" in refused(capsys, *start, "--mesh", tmp_path / "mesh_##.stl")
    (tmp_path / "mesh.stl").rename(tmp_path / "mesh_01.stl")
    assert "no voxel" in refused(capsys, *start, "--mesh", tmp_path / "mesh_##.stl")
    assert not (tmp_path / "out").exists()
