"""Bad input: one sentence that names what is wrong, and the exit status for it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from command_line import QUICK, command, events, names, refused


def test_a_missing_file(tmp_path, capsys) -> None:
    """The path is named, for scenes, videos and pictures."""
    for name in ("shot.toml", "shot.mp4", "frame_####.png"):
        path = tmp_path / name
        assert name in refused(capsys, "reconstruct", path, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_file_that_is_no_video(tmp_path, capsys) -> None:
    """Text with a video's name."""
    (tmp_path / "shot.mp4").write_text("not a video " * 100)
    assert "shot.mp4" in refused(capsys, "reconstruct", tmp_path / "shot.mp4", "--out", tmp_path / "out")


@pytest.mark.parametrize("words", [("inspect",), ("evaluate", "smoke", "--truth"), ("check",)])
def test_an_address(capsys, words) -> None:
    """Nothing is downloaded."""
    assert command(*words, "https://example.com/smoke") == 2
    sentence = '"https://example.com/smoke" is an address; save the file on this computer and give its path'
    assert capsys.readouterr().err.splitlines()[-1].endswith(sentence)


def test_pictures_that_a_shell_has_named_one_by_one(capsys) -> None:
    """As it does with frame_*.png."""
    assert command("inspect", "frame_1.png", "frame_2.png", "frame_3.png") == 2
    sentence = "error: 3 pictures are named; give those of a clip as one pattern, frame_####.png"
    assert capsys.readouterr().err.splitlines()[-1].endswith(sentence)


def test_an_unknown_key(shot, tmp_path, capsys) -> None:
    """The key and its line."""
    text = shot.read_text().replace("[medium]\n", "[medium]\ncolour = 3\n")
    (tmp_path / "bad.toml").write_text(text)
    sentence = refused(capsys, "reconstruct", tmp_path / "bad.toml", "--out", tmp_path / "out")
    assert "bad.toml" in sentence
    assert "colour" in sentence
    assert str(text[: text.index("colour")].count("\n") + 1) in sentence


def test_a_scene_without_a_clip(plume, tmp_path, capsys) -> None:
    """There is nothing to reconstruct from."""
    replace(plume.scene, clip=None).save(tmp_path / "scene.toml")
    assert "[clip]" in refused(capsys, "reconstruct", tmp_path / "scene.toml", "--out", tmp_path / "out")


@pytest.mark.parametrize("span", ["2:9", "7:8"])
def test_frames_outside_the_clip(shot, tmp_path, capsys, span) -> None:
    """The range that was asked for, and the one there is."""
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--frames", span)
    assert "0 to 4" in sentence
    assert not (tmp_path / "out").exists()


def test_frames_in_the_wrong_order(shot, tmp_path, capsys) -> None:
    """Last before first."""
    assert "frames" in refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--frames", "3:1")


@pytest.mark.parametrize(
    "option",
    [
        ("--frames", "1-2"),
        ("--resolution", "64,64"),
        ("--quality", "best"),
        ("--resolution", "a,b,c"),
        ("--scattering", "many"),
        ("--distance", "far"),
        ("--detail", "much"),
        ("--seed", "1.5"),
    ],
)
def test_options_that_make_no_sense(shot, tmp_path, capsys, option) -> None:
    """Status 2, and the last line names the option."""
    assert command("reconstruct", shot, "--out", tmp_path / "out", *option) == 2
    assert option[0] in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (("--detail", "1.5"), "detail must be a number from 0 to 1, not 1.5"),
        (("--detail", "nan"), "detail must be a number from 0 to 1, not nan"),
        (("--seed", "-1"), "seed must be a whole number from 0, not -1"),
    ],
)
def test_what_is_made_up_has_limits(shot, tmp_path, capsys, option, words) -> None:
    """One sentence with the range, before anything is written."""
    assert words in refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", *option)
    assert not (tmp_path / "out").exists()


def test_a_resolution_too_low(shot, tmp_path, capsys) -> None:
    """The least number of voxels is said."""
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--resolution", "4,4,4")
    assert "8 voxels" in sentence


def test_a_resolution_without_cubes(shot, tmp_path, capsys) -> None:
    """A calibrated box fixes the shape."""
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--npz", "--resolution", "16,16,16")
    assert "cubic voxels" in sentence


def test_a_directory_of_other_files(shot, tmp_path, capsys) -> None:
    """Nothing is overwritten, and the directory is named."""
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "holiday.jpg").write_text("precious")
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "photos", "--npz", *QUICK)
    assert "photos" in sentence
    assert "holiday.jpg" in sentence
    assert names(tmp_path / "photos") == ["holiday.jpg"]


def test_a_file_as_directory(shot, tmp_path, capsys) -> None:
    """The path is named."""
    (tmp_path / "taken").write_text("precious")
    assert "taken" in refused(capsys, "reconstruct", shot, "--out", tmp_path / "taken", "--npz", *QUICK)
    assert (tmp_path / "taken").read_text() == "precious"


def test_again_without_resume(finished, shot, capsys) -> None:
    """The sentence says how to go on."""
    sentence = refused(capsys, "reconstruct", shot, "--out", finished, "--npz", *QUICK)
    assert "resume the run" in sentence
    assert finished.name in sentence


def test_resume_with_other_settings(finished, shot, capsys) -> None:
    """The difference is named."""
    sentence = refused(capsys, "reconstruct", shot, "--out", finished, "--npz", "--resume", "--quality", "balanced")
    assert "quality" in sentence


def test_errors_as_json(tmp_path, capsys) -> None:
    """Programs get the sentence and the status as the last event."""
    assert command("reconstruct", tmp_path / "no.mp4", "--out", tmp_path / "out", "--progress", "json") == 2
    captured = capsys.readouterr()
    assert captured.err == ""
    last = events(captured.out)[-1]
    assert (last["event"], last["status"]) == ("error", 2)
    assert "no.mp4" in last["text"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--out", "file"), "file: cannot be written to"),
        (("--out", "file/out"), "cannot be written to"),
        (("--out", "others"), r"holds other files (holiday.jpg)"),
        (("--out", "damaged"), "sequence.json: cannot be read"),
        (("--out", "out", "--thumbnail", "nowhere/a.png"), "the folder nowhere does not exist"),
        (("--out", "out", "--thumbnail", "others"), "others: is a folder"),
        (("--out", "out", "--thumbnail", "out.png/a.png"), "the folder out.png does not exist"),
        (("--out", "others", "--thumbnail", "others/a.png", "--resume"), "holds other files"),
        (("--out", ".", "--thumbnail", "deep/a.png"), "holds other files"),
    ],
)
def test_what_cannot_be_written_is_refused_before_the_clip_is_looked_at(
    shot, tmp_path, capsys, monkeypatch, words, sentence
) -> None:
    """The analysis of a clip takes minutes."""

    def look(*_arguments: object) -> None:
        raise AssertionError("the clip was read")

    monkeypatch.setattr("smokelift.app.commands.reconstruct.reconstruct", look)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    for folder in ("others", "damaged", "deep"):
        (tmp_path / folder).mkdir()
    (tmp_path / "others" / "holiday.jpg").touch()
    (tmp_path / "damaged" / "sequence.json").write_text("{")
    assert sentence in refused(capsys, "reconstruct", shot, *words)


def test_a_thumbnail_among_the_frames_is_refused(shot, tmp_path, capsys) -> None:
    """It would keep the run from going on."""
    out = tmp_path / "out"
    out.mkdir()
    sentence = refused(capsys, "reconstruct", shot, "--out", out, "--thumbnail", out / "last.png")
    assert "the thumbnail cannot lie in" in sentence
    assert names(out) == []
