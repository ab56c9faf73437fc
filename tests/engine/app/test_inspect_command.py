"""``smokelift inspect``: what is assumed and chosen."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from command_line import QUICK, command, events_of, refused

from smokelift import Background, Scene, Sequence
from smokelift.footage.image_files import read_image
from smokelift.output.images import write_image
from smokelift.setup.settings import QUALITIES


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
    for what in ("exposure", "camera", "scale", "extinction", "albedo", "source radiance", "sun's direction"):
        assert origins[what] == "undetermined", what
    assert origins["sun's color"] == origins["ambient fraction"] == "undetermined"
    assert origins["background"] == origins["box"] == "estimated"
    assert origins["scattering"] == origins["resolution"] == origins["noise"] == "measured"


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
    words = ("--frames", "0:2", "--detail", "0", *QUICK)
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
    words = ("--frames", "6:6", "--detail", "0", *QUICK)
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
