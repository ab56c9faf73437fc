"""``smokelift inspect``: what is assumed and chosen."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from command_line import QUICK, command, events, refused

from smokelift.footage.images import read_image
from smokelift.output.images import write_image
from smokelift.output.sequence import Sequence
from smokelift.scene import Background, DirectionalLight, Inlet, Medium, Scene
from smokelift.setup.settings import QUALITIES
from smokelift.setup.sky import light_around
from tests.engine.setup.shots import filmed_around


def test_inspect_says_how_smoke_gets_in_and_out(plume, tmp_path, capsys) -> None:
    """Marked inlets and closed sides, and the scene that would be run."""
    scene = replace(plume.scene, closed=("z-",), inlets=(Inlet((0, 0, 0.2), 0.1),))
    scene.save(tmp_path / "scene.toml")
    assert command("inspect", tmp_path / "scene.toml", "--progress", "json", *QUICK) == 0
    *notes, done = events(capsys.readouterr().out)
    assert {"inlets", "closed sides"} < {event["kind"] for event in notes}
    assert done["scene"]["domain"]["closed"] == ["z-"]
    assert done["scene"]["inlet"] == [{"centre": [0.0, 0.0, 0.2], "radius": 0.1}]


def test_choices_are_said_and_kept(shot, finished, capsys) -> None:
    """The same from inspect, as sentences and as JSON, and with the sequence, each with its figures."""
    kept = Sequence.open(finished).choices
    assert [choice["what"] for choice in kept] == [
        "resolution", "scattering", "domain", "iterations", "velocity grid coarsening", "velocity levels",
        "axis depth",
    ]  # fmt: skip
    assert json.loads((finished / "sequence.json").read_text())["choices"] == list(kept)
    assert command("inspect", shot, "--progress", "json", *QUICK) == 0
    *notes, done = events(capsys.readouterr().out)
    assert done["choices"] == list(kept)
    said = [event["text"] for event in notes]
    assert all(choice["reason"] in said for choice in kept)
    (scattering,) = (choice for choice in kept if choice["what"] == "scattering")
    assert scattering["chosen"] == Sequence.open(finished).scene.scattering == "single"
    assert scattering["measured"]["error_unshadowed"] > scattering["tolerance"]
    assert command("inspect", shot, *QUICK) == 0
    assert scattering["reason"] in "".join(capsys.readouterr().out.splitlines())


def test_every_quality_is_forecast(plume, tmp_path, capsys) -> None:
    """In one run, as a run at each quality has it; where the resolution is given, all have that."""
    path = tmp_path / "scene.toml"
    replace(plume.scene, camera=None, domain=None).save(path)

    def forecast(*words: str) -> dict[str, Any]:
        assert command("inspect", path, "--progress", "json", "--device", "cpu", *words) == 0
        *_, done = events(capsys.readouterr().out)
        return done

    done = forecast("--quality", "draft")
    assert list(done["qualities"]) == list(QUALITIES)
    for quality, said in done["qualities"].items():
        assert said["memory"] <= done["qualities"]["final"]["memory"]
        assert said["lost"] >= done["qualities"]["final"]["lost"]
        own = forecast("--quality", quality)
        assert said["resolution"] == own["scene"]["domain"]["resolution"]
        assert said["memory"] == pytest.approx(own["memory"], rel=0.01)
    given = forecast("--resolution", "12,12,16")["qualities"]
    assert [(name, said["resolution"], said["lost"]) for name, said in given.items()] == [
        (name, [12, 12, 16], None) for name in QUALITIES
    ]


def test_an_inlet_outside_the_box(plume, tmp_path, capsys) -> None:
    """One sentence."""
    path = tmp_path / "scene.toml"
    plume.scene.save(path)
    path.write_text(path.read_text() + "\n[[inlet]]\ncentre = [9, 0, 0]\nradius = 1\n")
    assert command("inspect", path, *QUICK) == 2
    assert "[[inlet]] is outside the domain" in capsys.readouterr().err


@pytest.mark.parametrize("kind", [".png", ".html"])
def test_a_page_shows_what_is_known(plume, tmp_path, capsys, kind) -> None:
    """What nothing shows is called undetermined, what is given is called given."""
    page = tmp_path / f"page{kind}"
    assert command("inspect", plume.scene.clip.path, "--page", page, "--progress", "json", *QUICK) == 0
    done = events(capsys.readouterr().out)[-1]
    assert done["files"] == [str(page)]
    known = {fact["what"]: fact for fact in done["facts"]}
    for what in ("exposure", "camera", "scale", "extinction", "albedo", "light strength", "smoke thickness"):
        assert known[what]["origin"] == "undetermined"
    assert known["light strength"]["how"] != known["smoke thickness"]["how"]
    for what in ("sun's direction", "sun's colour", "ambient share"):
        assert known[what]["origin"] == "undetermined"
    if kind == ".html":
        assert "sun&#x27;s direction" in page.read_text(encoding="utf-8")
    assert known["background"]["origin"] == known["box"]["origin"] == "estimated"
    assert known["scattering"]["origin"] == known["grid"]["origin"] == known["noise"]["origin"] == "measured"
    assert page.stat().st_size > 5000


def test_a_sun_that_four_cameras_tell_is_called_measured(plume, tmp_path, capsys) -> None:
    sun = DirectionalLight((-0.5, -0.6, -0.4), (12.0, 11.0, 10.0))
    filmed_around(plume, tmp_path, (sun,)).save(tmp_path / "scene.toml")
    written = tmp_path / "found.toml"
    assert command("inspect", tmp_path / "scene.toml", "--write", written, "--progress", "json", *QUICK) == 0
    known = {fact["what"]: fact for fact in events(capsys.readouterr().out)[-1]["facts"]}
    assert known["light strength"]["origin"] == known["sun's direction"]["origin"] == "measured"
    assert known["ambient share"]["value"].endswith("%")
    strongest = max(Scene.load(written).lights, key=lambda light: sum(light.irradiance))
    assert known["sun's direction"]["value"] == ", ".join(f"{value:.2f}" for value in strongest.direction)


def test_what_is_given_is_called_given(shot, capsys) -> None:
    """Camera, box, medium, light and background of a scene file."""
    assert command("inspect", shot, "--progress", "json", *QUICK) == 0
    known = {fact["what"]: fact["origin"] for fact in events(capsys.readouterr().out)[-1]["facts"]}
    assert {known[what] for what in ("camera", "scale", "box", "extinction", "albedo", "light")} == {"given"}
    assert "sun's direction" not in known


def test_a_camera_that_is_given_without_its_box_has_a_box_that_is_found(plume, tmp_path, capsys) -> None:
    """Only the camera is called given."""
    replace(plume.scene, domain=None).save(tmp_path / "scene.toml")
    assert command("inspect", tmp_path / "scene.toml", "--progress", "json", *QUICK) == 0
    known = {fact["what"]: fact["origin"] for fact in events(capsys.readouterr().out)[-1]["facts"]}
    assert known["camera"] == "given"
    assert (known["scale"], known["box"], known["grid"]) == ("undetermined", "estimated", "measured")


def test_a_mask_is_outlined_and_kept(plume, tmp_path, capsys) -> None:
    """On the page, in the facts, and in the scene file that is written."""
    mask = np.ones((56, 40, 3))
    mask[:, :8] = 0
    write_image(tmp_path / "mask.png", mask)
    scene, page = tmp_path / "scene.toml", tmp_path / "page.html"
    clip = plume.scene.clip.path
    assert command("inspect", clip, "--mask", tmp_path / "mask.png", "--page", page, "--write", scene, *QUICK) == 0
    assert "the mask&#x27;s outline" in page.read_text(encoding="utf-8")
    assert "mask: hides 20% of the first frame (given)" in scene.read_text()
    assert Scene.load(scene).clip.mask == tmp_path / "mask.png"


def test_a_page_of_a_moving_camera_has_its_path(tracked, tmp_path) -> None:
    """Where the box goes in the picture."""
    tracked.save(tmp_path / "scene.toml")
    assert command("inspect", tmp_path / "scene.toml", "--page", tmp_path / "page.html", *QUICK) == 0
    assert "path of the box" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_a_clip_without_smoke_has_a_page_that_says_so(plume, tmp_path, capsys) -> None:
    """Nothing is called measured or put around the smoke."""
    plume.write(tmp_path / "clip", [np.zeros_like(plume.densities[0])] * 2)
    clip, page = tmp_path / "clip" / "frame_####.png", tmp_path / "page.html"
    assert command("inspect", clip, "--page", page, "--progress", "json", *QUICK) == 0
    *notes, done = events(capsys.readouterr().out)
    said = " ".join(event["text"] for event in notes)
    assert "no smoke examined" in [event.get("kind") for event in notes]
    assert '<p class="warning">No smoke found' in page.read_text(encoding="utf-8")
    assert "around the smoke" not in said + str(done["facts"])
    assert "thickest smoke" not in said + str(done["facts"])
    known = {fact["what"]: fact["origin"] for fact in done["facts"]}
    assert known["box"] == known["grid"] == "undetermined"


def test_a_scene_of_all_estimates_gives_the_same_smoke(plume, tmp_path, capsys) -> None:
    """Written, read and run, it differs by no more than noise from the run that estimates for itself."""
    clip, scene = plume.scene.clip.path, tmp_path / "scene.toml"
    words = ("--frames", "0:2", "--detail", "0", *QUICK)
    assert command("inspect", clip, "--write", scene, *words) == 0
    assert "# ambient share: all light is from everywhere (undetermined)" in scene.read_text(encoding="utf-8")
    for name, source in (("own", clip), ("written", scene)):
        assert command("reconstruct", source, "--out", tmp_path / name, "--npz", *words) == 0
    own, written = (Sequence.open(tmp_path / name) for name in ("own", "written"))
    assert written.scene.domain == own.scene.domain
    assert written.scene.lights == own.scene.lights
    for number in (1, 2, 3):
        first, second = own.density(number), written.density(number)
        assert np.linalg.norm(second - first) < 0.02 * np.linalg.norm(first)
    assert "is there already; nothing was overwritten" in refused(capsys, "inspect", clip, "--write", scene, *words)


def test_light_from_everywhere_is_found_in_a_clip_and_reaches_the_volume(plume, tmp_path) -> None:
    """Where nothing tells the light, and smoke before one colour has a lit side: six lights with shadows."""
    sun = DirectionalLight((-0.8, 0.5, -0.3), (1.5, 1.35, 1.1))
    lights, behind = (sun, *light_around(np.full(3, 0.2))), Background(color=(0.3, 0.3, 0.3))
    true = replace(plume.scene, medium=Medium(6.0, 0.9), lights=lights, background=behind)
    densities = [np.roll(plume.densities[0], 3 * n, axis=2) for n in range(4)]
    filmed = plume.write(tmp_path / "clip", densities, true)
    replace(filmed, medium=None, lights=(), background=None).save(tmp_path / "clip.toml")
    written, words = tmp_path / "written.toml", ("--detail", "0", *QUICK)
    assert command("inspect", tmp_path / "clip.toml", "--write", written, *words) == 0
    scene = Scene.load(written)
    assert (scene.scattering, len(scene.lights)) == ("single", 6)
    assert np.allclose(np.sum([light.direction for light in scene.lights], 0), 0)
    assert command("reconstruct", written, "--out", tmp_path / "out", "--npz", "--frames", "0:1", *words) == 0
    sequence = Sequence.open(tmp_path / "out")
    assert sequence.scene.lights == scene.lights
    assert all(sequence.figures(number)["psnr"] > 40 for number in (1, 2))
    assert sequence.density(2).any()


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
    text = scene.read_text(encoding="utf-8")
    assert "of it unknown (estimated)" in text
    assert "scene_background.exr shows it" in text
    seen = np.abs(read_image(tmp_path / "scene_background.exr") - wall).max(-1)
    assert np.median(seen) < 0.03
    for name, source in (("own", clip), ("written", scene)):
        assert command("reconstruct", source, "--out", tmp_path / name, "--npz", *words) == 0
    own, written = (Sequence.open(tmp_path / name) for name in ("own", "written"))
    assert own.density(1).any()
    np.testing.assert_allclose(written.density(1), own.density(1), rtol=1e-4, atol=1e-5)


def test_a_camera_that_was_steadied_is_found_again(tmp_path, capsys) -> None:
    """Its turns and the background belong together; the page shows its path."""
    random = np.random.default_rng(0)
    wall = np.clip(0.3 + 0.1 * np.kron(random.standard_normal((35, 45)), np.ones((4, 4))), 0, 1)
    rows, columns = np.mgrid[:140, :180]
    for n, (down, right) in enumerate(random.integers(-4, 5, (8, 2)) + 8):
        smoke = 0.8 * np.exp(-((rows - 95 + 6 * n) ** 2 + (columns - 90) ** 2) / 200)
        seen = (wall * (1 - smoke) + 0.9 * smoke)[down : down + 120, right : right + 160]
        write_image(tmp_path / f"shaken_{n}.png", seen)
    scene, page = tmp_path / "scene.toml", tmp_path / "page.html"
    words = ("--progress", "json", *QUICK)
    assert command("inspect", tmp_path / "shaken_#.png", "--write", scene, "--page", page, *words) == 0
    first = events(capsys.readouterr().out)[-1]["scene"]
    assert "path of the box" in page.read_text(encoding="utf-8")
    assert Scene.load(scene).camera is None
    assert command("inspect", scene, *words) == 0
    assert events(capsys.readouterr().out)[-1]["scene"]["camera"] == first["camera"]


def test_pages_of_other_kinds_are_refused(shot, tmp_path, capsys) -> None:
    """Before the clip is inspected."""
    assert ".png or .html" in refused(capsys, "inspect", shot, "--page", tmp_path / "page.pdf")
    assert "does not exist" in refused(capsys, "inspect", shot, "--write", tmp_path / "none" / "scene.toml")
