"""``smokelift reconstruct``: what it writes and says."""

from dataclasses import replace

import numpy as np
import pytest
from command_line import QUICK, command, events_of, names, refused

from smokelift.output.sequence import Sequence
from smokelift.scene import completed
from smokelift.setup.settings import QUALITIES
from tests.engine.output.small_sequence import has_vdb


def test_reconstruct_writes_a_sequence(finished, plume) -> None:
    sequence = Sequence.open(finished)
    assert sequence.complete
    assert sequence.frames == (1, 2, 3, 4, 5)
    assert sequence.scene == completed(plume.scene)
    kinds = ("npz", "vdb") if has_vdb() else ("npz",)
    assert names(finished) == ["sequence.json", *(f"smoke_000{n}.{kind}" for n in range(1, 6) for kind in kinds)]
    assert all(sequence.figures(n)["psnr"] >= 35 for n in sequence.frames)


def test_files_are_numbered_as_the_clip_and_every_command_goes_on(shot, tmp_path, capsys) -> None:
    out, more = tmp_path / "out", tmp_path / "more"
    words = ("reconstruct", shot, "--out", out, "--npz", "--frames", "0:3", "--start-number", 1001, *QUICK)
    for each in (
        words,
        ("check", out),
        ("render", out, "--frame", 3, "--out", tmp_path / "a.png"),
        ("continue", out, "--frames", 2, "--out", more, "--npz"),
        (*words, "--resume"),
    ):
        assert command(*each) == 0, capsys.readouterr().err
    assert Sequence.open(out).frames == (1, 2, 3, 4)
    assert {f"smoke_100{n}.npz" for n in range(1, 5)} <= set(names(out))
    assert Sequence.open(more).start_number == 1001
    assert {f"smoke_100{n}.npz" for n in range(1, 7)} <= set(names(more))
    for wrong in ("-1", "1.5", "99999999"):
        assert command("reconstruct", shot, "--out", out, "--start-number", wrong) == 2
        assert "expected a whole number from 0 to 1000000" in capsys.readouterr().err


def test_progress_as_json(plume, tmp_path, capsys) -> None:
    replace(plume.scene, medium=None).save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    sent = events_of(capsys, "reconstruct", tmp_path / "scene.toml", "--out", out, "--npz", *QUICK)
    notes = [event["kind"] for event in sent if event["event"] == "note"]
    assert [event["event"] for event in sent] == [*["note"] * len(notes), "start", *["frame"] * 5, "done"]
    medium = sent[notes.index("assumed medium")]
    assert medium["text"].startswith("Medium not given") and medium["figures"]["albedo"] == 0.9
    start, *frames, done = sent[len(notes) :]
    assert (start["total"], start["done"]) == (5, 0)
    assert {fact["what"] for fact in start["facts"]} >= {"background", "scale"} and len(start["background_color"]) == 3
    assert set(start["qualities"]) == set(QUALITIES)
    assert all(said["seconds"] > 0 for said in start["qualities"].values())
    assert [(event["frame"], event["done"], event["total"]) for event in frames] == [(n, n, 5) for n in range(1, 6)]
    assert frames[-1]["seconds_left"] == 0
    assert (done["kind"], done["directory"], done["frames"]) == ("reconstructed", str(out), 5)
    middle = float(np.median([event["figures"]["psnr"] for event in frames]))
    assert done["psnr"] == done["figures"]["psnr"] == pytest.approx(middle) and middle > 30


def test_one_picture_alone_is_enough_before_one_color(plume, tmp_path, capsys) -> None:
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


def test_what_is_made_up_is_chosen_said_and_kept(shot, tmp_path, capsys) -> None:
    out, words = tmp_path / "out", ("--npz", "--frames", "0:0", "--detail", "0.5", *QUICK)
    assert command("reconstruct", shot, "--out", out, "--seed", "3", *words) == 0
    sequence = Sequence.open(out)
    assert (sequence.settings["detail"], sequence.settings["seed"]) == (0.5, 3)
    (part,) = (part for part in sequence.provenance if part["origin"] == "made up")
    assert part["settings"] == {"detail": 0.5, "seed": 3}
    assert part["how"] in " ".join(capsys.readouterr().out.split())
    assert "settings.seed" in refused(capsys, "reconstruct", shot, "--out", out, "--resume", "--seed", "4", *words)


def test_scattering_and_resolution_by_option(shot, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    arguments = ("--npz", "--frames", "0:0", "--resolution", "auto", "--scattering", "unshadowed")
    assert command("reconstruct", shot, "--out", out, *arguments) == 0
    sequence = Sequence.open(out)
    assert sequence.scene.scattering == "unshadowed"
    by_hand = {choice["what"]: choice["by_hand"] for choice in sequence.choices}
    assert (by_hand["scattering"], by_hand["resolution"]) == (True, False)
    assert max(sequence.scene.domain.resolution) > 32
    assert command("reconstruct", shot, "--out", out, "--resume", *arguments) == 0
    said = refused(capsys, "reconstruct", shot, "--out", out, "--resume", *arguments[:5])
    assert "settings.scattering was" in said


def test_no_smoke_at_all_is_said(plume, tmp_path, capsys) -> None:
    nothing = np.zeros_like(plume.densities[0])
    plume.write(tmp_path / "clip", [nothing] * 2).save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    assert "No smoke found" in refused(capsys, "reconstruct", tmp_path / "scene.toml", "--out", out, "--npz", *QUICK)
    sequence = Sequence.open(out)
    assert not any(sequence.density(n).any() for n in (1, 2))
    assert not any("psnr" in sequence.figures(n) for n in (1, 2))
