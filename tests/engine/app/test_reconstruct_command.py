"""``smokelift reconstruct``: what it writes and says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from command_line import QUICK, command, events, names, refused

from smokelift.output.images import write_image
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import VdbUnavailable, vdb_module
from smokelift.scene import completed

MADE_UP = "the texture of the clip's own pictures"
"""In the sentence on fine structure that no camera shows."""

GOOD_FRONT = 38.0
"""PSNR (dB) of a front that is fitted: seeds 0 and 1 have 40.7 and 42.8."""


def test_reconstruct_writes_a_sequence(finished, plume) -> None:
    """All frames, complete, with the scene as it was given; a NumPy twin each."""
    sequence = Sequence.open(finished)
    assert sequence.complete
    assert sequence.frames == (1, 2, 3, 4, 5)
    assert sequence.scene == completed(plume.scene)
    assert {f"smoke_000{n}.npz" for n in range(1, 6)} <= set(names(finished))
    assert all(sequence.figures(n)["psnr"] >= 35 for n in sequence.frames)


def test_reconstruct_writes_vdb_files(shot, tmp_path, capsys) -> None:
    """OpenVDB is what is written by default, and the last line says where."""
    try:
        vdb_module()
    except VdbUnavailable as missing:
        pytest.skip(str(missing))
    assert command("reconstruct", shot, "--out", tmp_path / "out", "--frames", "0:1", *QUICK) == 0
    assert names(tmp_path / "out") == ["sequence.json", "smoke_0001.vdb", "smoke_0002.vdb"]
    out = "".join(capsys.readouterr().out.splitlines())
    assert "2 frames in" in out
    assert Sequence.open(tmp_path / "out").density(2).any()


def test_a_wrong_mask_is_refused_in_a_sentence(shot, tmp_path, capsys) -> None:
    """Before anything is read."""
    write_image(tmp_path / "black.png", np.zeros((4, 4, 3)))
    words = ("reconstruct", shot, "--out", tmp_path / "out", *QUICK, "--mask")
    assert "no such file" in refused(capsys, *words, tmp_path / "none.png")
    assert "this mask is black everywhere" in refused(capsys, *words, tmp_path / "black.png")
    assert "holds no video stream" in refused(capsys, *words, shot)
    assert not (tmp_path / "out").exists()


def test_progress_as_json(plume, tmp_path, capsys) -> None:
    """Each line an object: notes, then start, then every frame, then done."""
    scene = replace(plume.scene, medium=None)
    scene.save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    assert command("reconstruct", tmp_path / "scene.toml", "--out", out, "--npz", "--progress", "json", *QUICK) == 0
    captured = capsys.readouterr()
    sent = events(captured.out)
    assert captured.err == ""
    notes = [event["kind"] for event in sent if event["event"] == "note"]
    assert [event["event"] for event in sent] == [*["note"] * len(notes), "start", *["frame"] * 5, "done"]
    assert notes[0] == "assumed medium"
    assert sent[0]["text"].startswith("Medium not given") and sent[0]["figures"]["albedo"] == 0.9
    start, *frames = sent[len(notes) : -1]
    assert (start["total"], start["done"]) == (5, 0)
    assert [(event["frame"], event["done"], event["total"]) for event in frames] == [(n, n, 5) for n in range(1, 6)]
    assert all(event["figures"]["psnr"] > 30 for event in frames)
    assert sent[-2]["seconds_left"] == 0
    assert (sent[-1]["directory"], sent[-1]["frames"]) == (str(out), 5)
    middle = float(np.median([event["figures"]["psnr"] for event in frames]))
    assert sent[-1]["psnr"] == pytest.approx(middle)
    assert (sent[-1]["kind"], sent[-1]["figures"]["psnr"]) == ("reconstructed", pytest.approx(middle))


def test_further_views_of_a_scene_file_are_used(two_views, tmp_path, capsys) -> None:
    """They are named before the run, keep step with a range of frames, and their fit is on record."""
    two_views.save(tmp_path / "scene.toml")
    sent = "View 1: frame_####.png, 90 degrees from the input, frames 3 to 4."
    assert command("inspect", tmp_path / "scene.toml", "--frames", "2:3", *QUICK) == 0
    assert sent in " ".join(capsys.readouterr().out.split())
    arguments = ("--npz", "--frames", "2:3", *QUICK)
    assert command("reconstruct", tmp_path / "scene.toml", "--out", tmp_path / "out", *arguments) == 0
    assert sent in " ".join(capsys.readouterr().out.split())
    sequence = Sequence.open(tmp_path / "out")
    assert all(sequence.figures(number)["psnr_view_1"] > 30 for number in (1, 2))


def test_a_clip_alone_is_enough(plume, tmp_path, capsys) -> None:
    """A pattern of pictures instead of a scene file, with a range of frames and a resolution."""
    out = tmp_path / "out"
    clip = str(plume.scene.clip.path)
    arguments = ("--npz", "--frames", "1:3", "--resolution", "16,16,24", "--progress", "json", *QUICK)
    assert command("reconstruct", clip, "--out", out, *arguments) == 0
    assert [event["event"] for event in events(capsys.readouterr().out)].count("note") >= 5
    sequence = Sequence.open(out)
    assert sequence.frames == (1, 2, 3)
    assert sequence.scene.domain.resolution == (16, 16, 24)


def test_one_picture_alone_is_enough_before_one_colour(plume, tmp_path, capsys) -> None:
    """It gives smoke at rest, and the run says what counts as smoke."""
    picture = plume.write(tmp_path / "clip", plume.densities[:1]).clip.path.with_name("frame_0000.png")
    picture = picture.rename(tmp_path / "photograph.png")
    assert command("reconstruct", picture, "--out", tmp_path / "out", "--npz", *QUICK) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "One frame alone does not show what moves" in said
    assert "1 frame in" in said
    sequence = Sequence.open(tmp_path / "out")
    assert sequence.figures(1)["psnr"] > 35
    assert sequence.density(1).any()
    assert not sequence.velocity(1).centres().any()


def test_the_smoke_stands_where_the_command_says(shot, finished, tmp_path) -> None:
    """Its distance reaches the settings and the smoke, whose made-up detail moves the middle a little."""
    assert command("reconstruct", shot, "--out", tmp_path / "out", "--npz", "--distance", "3.8", *QUICK) == 0
    near, plain = Sequence.open(tmp_path / "out"), Sequence.open(finished)
    assert (near.settings["distance"], plain.settings["distance"]) == (3.8, None)
    y = np.arange(24) * 1.2 / 24
    moved = [np.average(y, weights=sequence.density(1).sum(axis=(0, 2))) for sequence in (near, plain)]
    assert moved[0] - moved[1] == pytest.approx(-0.2, abs=0.06)


def test_a_distance_outside_the_box(shot, tmp_path, capsys) -> None:
    """One sentence, also before a run, and nothing is written."""
    for words in (("reconstruct", shot, "--out", tmp_path / "out", "--npz"), ("inspect", shot)):
        sentence = refused(capsys, *words, "--distance", "4.7", *QUICK)
        assert "outside the box, which reaches from 3.4 to 4.6 m" in sentence
    assert not (tmp_path / "out").exists()


def test_what_is_made_up_is_chosen_said_and_kept(shot, finished, tmp_path, capsys) -> None:
    """Detail and seed reach the settings and the record; a run goes on with its own seed only."""
    out, words = tmp_path / "out", ("--npz", "--frames", "0:1", *QUICK)
    assert command("reconstruct", shot, "--out", out, "--detail", "0.5", "--seed", "3", *words) == 0
    sequence = Sequence.open(out)
    assert (sequence.settings["detail"], sequence.settings["seed"]) == (0.5, 3)
    (part,) = (part for part in sequence.provenance if part["origin"] == "made up")
    assert part["settings"] == {"detail": 0.5, "seed": 3}
    assert part["how"] in " ".join(capsys.readouterr().out.split())
    sentence = refused(capsys, "reconstruct", shot, "--out", out, "--resume", "--detail", "0.5", "--seed", "4", *words)
    assert "settings.seed was 3 and is now 4" in sentence
    plain = Sequence.open(finished)
    assert (plain.settings["detail"], plain.settings["seed"]) == (1.0, 0)
    assert "made up" in {part["origin"] for part in plain.provenance}


def test_another_seed_is_another_smoke_with_the_same_front(shot, finished, tmp_path) -> None:
    """The pictures fit as well; the depth differs, and from that of the smooth answer too."""
    first = Sequence.open(finished)
    assert first.figures(2)["psnr"] > GOOD_FRONT
    others = []
    for number, words in enumerate((("--seed", "1"), ("--detail", "0"), ("--detail", "0", "--seed", "1"))):
        out = tmp_path / str(number)
        assert command("reconstruct", shot, "--out", out, "--npz", "--frames", "0:1", *words, *QUICK) == 0
        others.append(Sequence.open(out))
        assert others[-1].figures(2)["psnr"] > GOOD_FRONT
    size = np.linalg.norm(first.density(2))
    again, smooth, same = (other.density(2) for other in others)
    assert np.linalg.norm(again - first.density(2)) > 0.02 * size
    assert np.linalg.norm(smooth - first.density(2)) > 0.02 * size
    np.testing.assert_array_equal(same, smooth)


def test_without_detail_nothing_is_said_to_be_made_up(shot, capsys) -> None:
    """Neither is it with the paper's method, which cannot do it."""
    for words in (("--detail", "0", *QUICK), ("--method", "paper", *QUICK)):
        assert command("inspect", shot, *words) == 0
        assert MADE_UP not in " ".join(capsys.readouterr().out.split())
    assert command("inspect", shot, *QUICK) == 0
    assert MADE_UP in " ".join(capsys.readouterr().out.split())
    assert "detail must be 0" in refused(capsys, "inspect", shot, "--method", "paper", "--detail", "1")


def test_scattering_and_resolution_by_option(shot, tmp_path, capsys) -> None:
    """What is said is used, and said to be by hand; auto measures the resolution of a given box."""
    out = tmp_path / "out"
    arguments = ("--npz", "--frames", "0:1", "--scattering", "unshadowed", "--resolution", "auto")
    assert command("reconstruct", shot, "--out", out, *arguments) == 0
    sequence = Sequence.open(out)
    assert sequence.scene.scattering == "unshadowed"
    by_hand = {choice["what"]: choice["by_hand"] for choice in sequence.choices}
    assert (by_hand["scattering"], by_hand["resolution"]) == (True, False)
    assert max(sequence.scene.domain.resolution) > 32
    assert command("reconstruct", shot, "--out", out, "--resume", *arguments) == 0
    assert "scattering" in refused(capsys, "reconstruct", shot, "--out", out, "--resume", *arguments[:3], *QUICK)


def test_no_smoke_at_all_is_said(plume, tmp_path, capsys) -> None:
    """Empty frames, exit 2, no figure of the fit, and a sentence that says what to do."""
    nothing = np.zeros_like(plume.densities[0])
    plume.write(tmp_path / "clip", [nothing] * 2).save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    assert "No smoke found" in refused(capsys, "reconstruct", tmp_path / "scene.toml", "--out", out, "--npz", *QUICK)
    sequence = Sequence.open(out)
    assert not any(sequence.density(n).any() for n in (1, 2))
    assert not any("psnr" in sequence.figures(n) for n in (1, 2))


def test_frames_without_smoke_are_counted(plume, tmp_path, capsys) -> None:
    """A run goes well all the same."""
    nothing = np.zeros_like(plume.densities[0])
    plume.write(tmp_path / "clip", [nothing, *plume.densities[:2]]).save(tmp_path / "scene.toml")
    assert command("reconstruct", tmp_path / "scene.toml", "--out", tmp_path / "out", "--npz", *QUICK) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "No smoke is seen in 1 of 3 frames" in said
    assert "Hardly any smoke was fitted" not in said


def test_a_fit_of_nothing_is_said(shot, tmp_path, capsys) -> None:
    """Smoke that only absorbs cannot show bright smoke before black."""
    words = ("--npz", "--frames", "0:1", "--scattering", "absorption", *QUICK)
    assert command("reconstruct", shot, "--out", tmp_path / "out", *words) == 0
    assert "differs from the clip by 100% of what its smoke changes" in " ".join(capsys.readouterr().out.split())
    assert Sequence.open(tmp_path / "out").figures(1)["relative_error"] == pytest.approx(1, abs=0.01)


def test_resuming_what_is_complete_changes_nothing(finished, shot) -> None:
    """Done already is done."""
    before = {path.name: path.read_bytes() for path in finished.glob("smoke_*")}
    assert command("reconstruct", shot, "--out", finished, "--npz", "--resume", *QUICK) == 0
    assert {path.name: path.read_bytes() for path in finished.glob("smoke_*")} == before
