"""Bad input: one sentence that names what is wrong, and the exit status for it."""

from dataclasses import replace

import numpy as np
import pytest
from command_line import QUICK, command, names, refused

from smokelift import ClipSource
from smokelift.output.images import write_image


@pytest.fixture
def here(shot, plume, tmp_path, monkeypatch):
    """Works in a folder with files of every wrong kind."""
    monkeypatch.chdir(tmp_path)
    for folder in ("others", "damaged", "deep"):
        (tmp_path / folder).mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "others" / "holiday.jpg").touch()
    (tmp_path / "damaged" / "sequence.json").write_text("{")
    (tmp_path / "text.mp4").write_text("not a video " * 100)
    (tmp_path / "bad.toml").write_text("[medium]\ncolors = 3\n")
    write_image(tmp_path / "black.png", np.zeros((4, 4, 3)))
    replace(plume.scene, clip=None).save(tmp_path / "clipless.toml")
    replace(plume.scene, clip=ClipSource(tmp_path / "gone.mp4")).save(tmp_path / "gone.toml")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("none.toml",), "none.toml"),
        (("none.mp4",), "none.mp4"),
        (("text.mp4",), "text.mp4"),
        (("bad.toml",), 'bad.toml, line 2: [medium] there is no key "colors"'),
        (("clipless.toml",), "[clip]"),
        (("SHOT", "--frames", "2:9"), "0 to 4"),
        (("SHOT", "--frames", "-2:3"), "frames must be [first, last], whole numbers from 0"),
        (("SHOT", "--detail", "1.5"), "detail must be"),
        (("SHOT", "--distance", "4.7", *QUICK), "reaches from 3.4 to 4.6 m"),
        (("SHOT", "--resolution", "4,4,4"), "8 voxels"),
        (("SHOT", "--resolution", "16,16,16"), "cubic voxels"),
        (("SHOT", "--mask", "black.png"), "leaves too little of the picture white"),
    ],
)
def test_a_run_that_cannot_be_is_refused_before_anything_is_written(here, shot, capsys, words, said) -> None:
    words = [str(shot) if word == "SHOT" else word for word in words]
    assert said in refused(capsys, "reconstruct", *words, "--out", "out", "--npz")
    assert not (here / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--out", "file"), "file: cannot be written to"),
        (("--out", "file/out"), "cannot be written to"),
        (("--out", "others"), r"holds other files (holiday.jpg)"),
        (("--out", "damaged"), "sequence.json: cannot be read"),
        (("--out", "out", "--thumbnail", "nowhere/a.png"), "the folder nowhere does not exist"),
        (("--out", "out", "--thumbnail", "others"), "others: is a folder"),
        (("--out", "out", "--thumbnail", "out.png/a.png"), "the folder out.png does not exist"),
        (("--out", "deep", "--thumbnail", "deep/a.png"), "the thumbnail cannot lie in"),
        (("--out", "others", "--thumbnail", "others/a.png", "--resume"), "holds other files"),
    ],
)
def test_what_cannot_be_written_is_refused_before_the_clip_is_read(here, capsys, words, said):
    """Whose file is missing."""
    assert said in refused(capsys, "reconstruct", "gone.toml", *words)
    assert names(here / "others") == ["holiday.jpg"] and names(here / "deep") == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        *(
            (("reconstruct", "a.mp4", "--out", "out", *option), option[0])
            for option in (
                *(("--frames", "1-2"), ("--resolution", "64,64"), ("--resolution", "a,b,c"), ("--quality", "best")),
                *(("--scattering", "many"), ("--distance", "far"), ("--seed", "1.5")),
            )
        ),
        (("inspect", "https://example.com/smoke"), "is an address"),
        (("evaluate", "smoke", "--truth", "https://example.com/smoke"), "is an address"),
        (("retime", "smoke", "--out", "out", "--speed", "slow"), "slow: expected a number from"),
        (("inspect", "frame_1.png", "frame_2.png", "frame_3.png"), "3 pictures are named"),
        (("inspect", "a.toml", "--frames", "0:1", "\udcff\udcfe.toml"), r"unrecognized arguments: \udcff\udcfe.toml"),
        (("reconstruct", "a.mp4", "--out", "\udcff"), "the path is no text in UTF-8: rename the file or the folder"),
        (("reconstruct", "a.mp4", "--out", ""), "the path is empty: give the name of a file or a folder"),
    ],
)
def test_words_that_make_no_sense(capsys, words, said) -> None:
    assert command(*words) == 2
    assert said in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(
    ("words", "said"), [((), "resume the run"), (("--resume", "--quality", "balanced"), "quality")]
)
def test_a_run_that_is_there_goes_on_only_as_it_began(finished, shot, capsys, words, said) -> None:
    sentence = refused(capsys, "reconstruct", shot, "--out", finished, "--npz", *QUICK, *words)
    assert said in sentence
    assert finished.name in sentence
