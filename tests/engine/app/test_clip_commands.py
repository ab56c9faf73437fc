"""The commands on a clip: reconstruct, extract and inspect; what they write and say."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import OpenEXR
import pytest
from command_line import QUICK, command, events_of, names, refused
from PIL import Image

from smokelift import Background, Clip, Scene, Sequence, extract, reconstruct
from smokelift.footage.image_files import read_image
from smokelift.output.images import write_image
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
    out, words = tmp_path / "out", (*QUICK, "--npz", "--frames", "0:0", "--detail", "0.5")
    assert command("reconstruct", shot, "--out", out, "--seed", "3", *words) == 0
    sequence = Sequence.open(out)
    assert (sequence.settings["detail"], sequence.settings["seed"]) == (0.5, 3)
    (part,) = (part for part in sequence.provenance if part["origin"] == "made up")
    assert part["settings"] == {"detail": 0.5, "seed": 3}
    assert part["how"] in " ".join(capsys.readouterr().out.split())
    assert "settings.seed" in refused(capsys, "reconstruct", shot, "--out", out, "--resume", "--seed", "4", *words)


def test_scattering_and_resolution_by_option(shot, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    arguments = ("--npz", "--frames", "0:0", "--detail", "0", "--resolution", "auto", "--scattering", "unshadowed")
    assert command("reconstruct", shot, "--out", out, *arguments) == 0
    sequence = Sequence.open(out)
    assert sequence.scene.scattering == "unshadowed"
    by_hand = {choice["what"]: choice["by_hand"] for choice in sequence.choices}
    assert (by_hand["scattering"], by_hand["resolution"]) == (True, False)
    assert max(sequence.scene.domain.resolution) > 32
    assert command("reconstruct", shot, "--out", out, "--resume", *arguments) == 0
    said = refused(capsys, "reconstruct", shot, "--out", out, "--resume", *arguments[:7])
    assert "settings.scattering was" in said


def test_no_smoke_at_all_is_said(plume, tmp_path, capsys) -> None:
    nothing = np.zeros_like(plume.densities[0])
    plume.write(tmp_path / "clip", [nothing] * 2).save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    assert "No smoke found" in refused(capsys, "reconstruct", tmp_path / "scene.toml", "--out", out, "--npz", *QUICK)
    sequence = Sequence.open(out)
    assert not any(sequence.density(n).any() for n in (1, 2))
    assert not any("psnr" in sequence.figures(n) for n in (1, 2))


@pytest.fixture(scope="module")
def before_wall(plume, tmp_path_factory) -> Iterator[Path]:
    """The scene file of the blob before a wall of blocks, whose picture is given."""
    folder = tmp_path_factory.mktemp("wall")
    camera = plume.scene.camera.resized(80, 112)
    blocks = np.random.default_rng(0).uniform(0.05, 0.4, (28, 20, 3)).astype(np.float32)
    write_image(folder / "plate.exr", np.kron(blocks, np.ones((4, 4, 1), np.float32)))
    scene = replace(plume.scene, camera=camera, background=Background(image=folder / "plate.exr"))
    plume.write(folder / "clip", plume.densities, scene, ".exr").save(folder / "scene.toml")
    return folder / "scene.toml"


def test_elements_are_numbered_as_the_frames_of_the_file(before_wall, tmp_path) -> None:
    words = ("extract", before_wall, "--frames", "1:2", "--out", tmp_path / "element_###.exr")
    assert command(*words, "--plate", tmp_path / "plate.exr", "--preview", tmp_path / "check.png") == 0
    assert sorted(path.name for path in tmp_path.glob("element_*")) == ["element_001.exr", "element_002.exr"]
    scene, plate = Scene.load(before_wall), read_image(tmp_path / "plate.exr")
    with Clip.open(scene.clip, frames=(1, 2)) as clip:
        seen = clip.frame(1)
        _, element = extract(clip, scene)
    (part,) = OpenEXR.File(str(tmp_path / "element_002.exr")).parts
    pixels = np.asarray(part.channels["RGBA"].pixels, np.float32)
    assert 0.5 < pixels[..., 3].max() <= 1 and pixels[:8, :8, 3].max() < 0.05
    over = pixels[..., :3] + (1 - pixels[..., 3:]) * plate
    assert np.sqrt(np.mean((over - seen) ** 2)) < 0.02
    np.testing.assert_allclose(pixels[..., 3], 1 - element.transmittance, atol=0.02)
    with Image.open(tmp_path / "check.png") as check:
        assert check.size == (160, 112)


def test_a_directory_and_a_video_are_taken_too(before_wall, tmp_path) -> None:
    words = ("extract", before_wall, "--frames", "0:2", "--out", tmp_path / "elements")
    assert command(*words, "--preview", tmp_path / "check.mp4") == 0
    assert len(list((tmp_path / "elements").glob("element_*.exr"))) == 3
    with av.open(str(tmp_path / "check.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == 3


def test_an_element_is_reconstructed_again(before_wall, smooth, tmp_path) -> None:
    assert command("extract", before_wall, "--frames", "1:1", "--out", tmp_path / "element_####.exr") == 0
    scene = replace(Scene.load(before_wall), clip=None, background=None)
    with Clip.open(tmp_path / "element_####.exr", fps=24) as clip:
        (frame,) = reconstruct(clip, scene, smooth)
    assert frame.figures["psnr"] > 30


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--out", "a_##.tif"), "elements are written as .exr or .png"),
        (("--out", "out", "--plate", "plate.tif"), "plate.tif: is written as .exr or .png"),
        (("--out", "out", "--preview", "check.gif"), "check.gif: is written as"),
        (("--out", "out", "--plate", "missing/plate.exr"), "the folder missing does not exist"),
        (("--out", "there.txt"), "is a file"),
    ],
)
def test_what_cannot_be_written_is_said_before_anything_is_spent(
    before_wall, tmp_path, monkeypatch, capsys, words, said
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.txt").touch()
    assert said in refused(capsys, "extract", before_wall, *words)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["there.txt"]


def test_choices_are_said_and_kept(shot, finished, capsys) -> None:
    kept = Sequence.open(finished).choices
    assert [choice["what"] for choice in kept] == [
        "resolution", "scattering", "velocity grid coarsening",
        "axis depth",
    ]  # fmt: skip
    *notes, done = events_of(capsys, "inspect", shot, *QUICK)
    assert done["choices"] == list(kept)
    said = [event["text"] for event in notes]
    assert all(choice["reason"] in said for choice in kept)
    (scattering,) = (choice for choice in kept if choice["what"] == "scattering")
    assert scattering["chosen"] == Sequence.open(finished).scene.scattering == "single"
    assert scattering["measured"]["error_unshadowed"] > scattering["tolerance"]


def test_every_quality_is_forecast(plume, tmp_path, capsys) -> None:
    path = tmp_path / "scene.toml"
    replace(plume.scene, camera=None, domain=None).save(path)

    def forecast(*words: str) -> dict[str, Any]:
        return events_of(capsys, "inspect", path, "--frames", "0:2", *words)[-1]

    done = forecast("--quality", "draft")
    assert list(done["qualities"]) == list(QUALITIES)
    finest = done["qualities"]["final"]
    assert all(said["memory"] <= finest["memory"] for said in done["qualities"].values())
    assert all(said["lost"] >= finest["lost"] for said in done["qualities"].values())
    for quality in ("balanced", "final"):
        said, own = done["qualities"][quality], forecast("--quality", quality)
        assert said["resolution"] == own["scene"]["domain"]["resolution"]
        assert said["memory"] == pytest.approx(own["memory"], rel=0.01)
    given = forecast("--resolution", "12,12,16")["qualities"]
    assert [(name, said["resolution"], said["lost"]) for name, said in given.items()] == [
        (name, [12, 12, 16], None) for name in QUALITIES
    ]


def test_pages_show_what_is_known(plume, tmp_path, capsys) -> None:
    pages = tmp_path / "page.png", tmp_path / "page.html"
    words = [word for page in pages for word in ("--page", page)]
    done = events_of(capsys, "inspect", plume.scene.clip.path, *words, *QUICK)[-1]
    assert done["files"] == list(map(str, pages))
    assert all(page.stat().st_size > 5000 for page in pages)
    assert "sun&#x27;s direction" in pages[1].read_text(encoding="utf-8")
    origins = {fact["what"]: fact["origin"] for fact in done["facts"]}
    assert (origins["camera"], origins["box"], origins["noise"]) == ("undetermined", "estimated", "measured")


def test_a_clip_without_smoke_has_a_page_that_says_so(plume, tmp_path, capsys) -> None:
    plume.write(tmp_path / "clip", [np.zeros_like(plume.densities[0])] * 2)
    clip, page = tmp_path / "clip" / "frame_####.png", tmp_path / "page.html"
    *notes, done = events_of(capsys, "inspect", clip, "--page", page, *QUICK)
    kinds = [event["kind"] for event in notes]
    assert "no smoke examined" in kinds and "box over the picture" in kinds
    assert '<p class="warning">No smoke found' in page.read_text(encoding="utf-8")
    known = {fact["what"]: fact["origin"] for fact in done["facts"]}
    assert known["box"] == known["resolution"] == "undetermined"


def test_a_scene_of_all_estimates_gives_the_same_smoke(plume, tmp_path, capsys) -> None:
    clip, scene = plume.scene.clip.path, tmp_path / "scene.toml"
    words = ("--frames", "0:2", *QUICK)
    assert command("inspect", clip, "--write", scene, *words) == 0
    assert "# ambient fraction: all light is from everywhere (undetermined)" in scene.read_text(encoding="utf-8")
    for name, source in (("own", clip), ("written", scene)):
        assert command("reconstruct", source, "--out", tmp_path / name, "--npz", *words) == 0
    own, written = (Sequence.open(tmp_path / name) for name in ("own", "written"))
    assert written.scene.domain == own.scene.domain
    assert written.scene.lights == own.scene.lights
    for number in (1, 2, 3):
        first, second = own.density(number), written.density(number)
        assert np.linalg.norm(second - first) < 0.02 * np.linalg.norm(first)
    assert "is there already; nothing was overwritten" in refused(capsys, "inspect", clip, "--write", scene, *words)


def test_a_background_that_is_a_picture_is_found_again(tmp_path) -> None:
    """What is unknown of it counts as in a run from the clip; its picture, not rounded, is there to be mended."""
    wall = np.kron(np.random.default_rng(0).uniform(0.05, 0.4, (7, 5, 3)), np.ones((8, 8, 1))).astype(np.float32)
    rows, columns = np.mgrid[:56, :40]
    (tmp_path / "clip").mkdir()
    for n in range(16):
        rising, staying = (np.hypot(rows - row, columns - 20) / 7 for row in (56 - 4 * n, 52 + n % 3))
        smoke = (0.7 + 0.2 * np.sin(1.3 * n)) * np.clip(1.5 - np.minimum(rising, staying), 0, 1)[..., None]
        write_image(tmp_path / "clip" / f"frame_{n:04d}.png", wall * (1 - smoke) + 0.8 * smoke)
    clip, scene = tmp_path / "clip" / "frame_####.png", tmp_path / "scene.toml"
    words = ("--frames", "6:6", *QUICK)
    assert command("inspect", clip, "--write", scene, *words) == 0
    assert Scene.load(scene).background is None
    given = tmp_path / "given.toml"
    given.write_text(f'[clip]\npath = "{clip}"\n[background]\nframe = 15\n', encoding="utf-8")
    assert command("inspect", given, "--write", tmp_path / "found.toml", *words) == 0
    assert Scene.load(tmp_path / "found.toml").background == Background(frame=(15,))
    text = scene.read_text(encoding="utf-8")
    assert "of it unknown (estimated)" in text
    assert "scene_background.exr shows it" in text
    seen = np.abs(read_image(tmp_path / "scene_background.exr") - wall).max(-1)
    assert np.median(seen) < 0.03
