"""The light of a shot, given or taken from the clip, and the smoke's own color, where no light explains it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from smokelift import Background, Clip, DirectionalLight, EnvironmentLight, Medium, Scene, Shot, prepare_shot
from smokelift.checks import UNDETERMINED, Finding
from smokelift.extraction.matte import HotPixels
from smokelift.footage.noise import lasting_noise
from smokelift.output.images import write_image
from smokelift.setup import illumination
from smokelift.setup.coarse import HeldOut
from smokelift.setup.first_estimate import SmokeSamples
from smokelift.setup.illumination import find_medium, light_doubts, several_colors, smoke_color, source_radiance
from tests.engine.conftest import Plume
from tests.engine.setup.shots import shot_of

# a light that is not given


def test_the_light_before_one_color_is_as_strong_as_the_thickest_smoke_asks(plume, draft, tmp_path) -> None:
    """Smoke that brightens black has a bright source, dark smoke before a bright wall one as dark as its darkest."""
    sooty = replace(
        plume.scene,
        medium=Medium(extinction=8.0, albedo=0.3),
        lights=(DirectionalLight((0, 0.5, -0.8), (2.0, 2.0, 2.0)),),
        background=Background(color=(0.8, 0.8, 0.8)),
    )
    for scene, low, high in ((plume.scene, 0.7, 1.5), (plume.write(tmp_path, plume.densities, sooty), 0.0, 1.1)):
        shot = shot_of(replace(scene, lights=()), draft)
        with Clip.open(scene.clip) as clip:
            thickest = min(float(frame.min()) for frame in clip) or max(float(frame.max()) for frame in clip)
        source = shot.scene.medium.albedo / (4 * np.pi) * np.array(shot.scene.lights[0].irradiance)
        assert low * thickest < source.max() < high * thickest


DETAIL = np.kron(np.random.default_rng(1).random((14, 10)), np.ones((4, 4)))[..., None] * (1.0, 0.8, 0.6)
GREEN = np.repeat(np.linspace((0.5, 0.7, 0.3), (0.4, 0.55, 0.22), 56, dtype=np.float32)[:, None], 40, axis=1)


@pytest.mark.parametrize(
    ("wall", "light"),
    [(0.02 + 0.4 * DETAIL, (9.0, 9.0, 9.0)), (0.02 + 0.4 * DETAIL, (10.8, 9.0, 6.75)), (GREEN, (4.0, 4.0, 4.0))],
    ids=["white", "warm", "smooth, of another hue"],
)
def test_before_a_picture_the_light_is_as_strong_as_the_smoke_hides(plume, draft, tmp_path, wall, light) -> None:
    """Thin smoke, which before one color looks as if it stood in fainter light, and through which a bright wall shows;
    the light's color is its own."""
    write_image(tmp_path / "wall.png", wall.astype("f4"))
    behind, lights = Background(image=tmp_path / "wall.png"), (DirectionalLight((0.3, 0.5, -0.8), light),)
    haze = replace(plume.scene, medium=Medium(1.5, 0.9), lights=lights, background=behind)
    shot = shot_of(replace(plume.write(tmp_path / "clip", plume.densities, haze), lights=()), draft)
    true = 0.9 / (4 * np.pi) * np.array(light)  # without the little that the haze shades itself
    found = chosen(shot, "source radiance")
    assert found.source == "measured"
    assert [found.figures[name] for name in ("red", "green", "blue")] == pytest.approx(true, rel=0.3)
    assert shot.optics.unshadowed_source() == pytest.approx(shot.views[0].source, rel=1e-4)


def test_a_given_light_has_the_white_balance_of_a_clip_in_which_that_changes(plume, draft, tmp_path) -> None:
    """Before a plate that was found in it: that is as red as the clip's middle, and so is the smoke before it."""
    write_image(tmp_path / "wall.png", (0.05 + 0.2 * DETAIL).astype("f4"))
    before = replace(plume.scene, background=Background(image=tmp_path / "wall.png"))
    passing = [plume.blob(plume.scene, height) for height in np.linspace(-0.3, 1.9, 14)]
    scene = replace(plume.write(tmp_path / "clip", passing, before), background=None)
    sources = []
    with Clip.open(scene.clip) as clip:
        for red in (0.0, 0.05):
            drifting = clip.changed(lambda n, picture, red=red: picture * (1 + n * np.array([red, 0, 0], np.float32)))
            sources.append(prepare_shot(drifting, scene, draft).views[0].source)
    red, green, blue = sources[1] / sources[0]
    assert 1.2 < red / green < 1.5 and green == pytest.approx(blue, rel=0.15)
    assert sources[1].mean() == pytest.approx(sources[0].mean(), rel=1e-3), "as bright as the light makes it"


# what light is doubted


@pytest.mark.parametrize(
    ("error", "behind", "noise", "said"),
    [
        (0.13, (0.4, 0.4, 0.4), 1, True),
        (0.11, (0.4, 0.4, 0.4), 1, False),
        (0.13, (0.003, 0.003, 0.003), 1, False),
        (0.13, (0.4, 0.4, 0.4), 5, False),
        (0.13, None, 1, False),
    ],
    ids=["one color", "well explained", "black", "noise", "a wall"],
)
def test_a_light_that_explains_little_before_one_color_is_said_to_be_wrong(error, behind, noise, said) -> None:
    shown = np.linspace(0.1, 0.5, 300).reshape(100, 3) if behind is None else np.tile(behind, (100, 1))
    samples = SimpleNamespace(behind=shown, smoky=(0,))
    choice = Finding("scattering", {"error_absorption": error}, about="scattering", value="absorption")
    for burns, kind in ((False, "likely wrong light"), (True, "light of fire")):
        doubts = light_doubts(choice, samples, lasting_noise(noise / 255), burns=burns)
        assert doubts == [Finding(kind, {"error": error}, doubt=True)] * said


def chosen(shot: Shot, about: str) -> Finding:
    (choice,) = (choice for choice in shot.findings if choice.about == about)
    return choice


def blob(plume: Plume, folder: Path, medium: Medium, irradiance: float | None, **changes: Any) -> Scene:
    """The blob of a medium in the plume's light, so strong and of one color."""
    (sun,) = plume.scene.lights
    lights = () if irradiance is None else (replace(sun, irradiance=(irradiance,) * 3),)
    scene = replace(plume.scene, medium=medium, lights=lights, **changes)
    return plume.write(folder, plume.densities, scene)


@pytest.fixture(scope="module")
def thin(plume, tmp_path_factory) -> Scene:
    """The blob as a haze in strong light."""
    return blob(plume, tmp_path_factory.mktemp("thin"), Medium(0.2, 0.9), 80.0)


# scattering


def test_thick_lit_smoke_needs_shadows(plume, draft) -> None:
    shot = shot_of(plume.scene, draft)
    choice = chosen(shot, "scattering")
    assert shot.scene.scattering == choice.value == "single"
    assert choice.figures["error_unshadowed"] > choice.figures["error_single"] + 2 * choice.figures["tolerance"]
    assert choice.figures["error_absorption"] > 0.9


def test_thick_white_smoke_scatters_light_many_times(plume, draft, tmp_path) -> None:
    white = blob(plume, tmp_path, Medium(20.0, 0.98), 5.0, scattering="multiple")  # nothing is too bright for a picture
    shot = shot_of(replace(white, scattering=None), draft)
    choice = chosen(shot, "scattering")
    assert shot.scene.scattering == choice.value == "multiple"
    assert choice.figures["error_multiple"] < choice.figures["error_single"] - choice.figures["tolerance"]
    assert (choice.kind, choice.figures["other"]) == ("compared scattering", "single")
    forward = replace(plume.scene, medium=replace(plume.scene.medium, anisotropy=0.3))
    assert "error_multiple" not in chosen(shot_of(forward, draft), "scattering").figures


@pytest.mark.parametrize(
    ("coarse", "fine", "asked", "model"),
    [
        ((0.05, 0.05), (0.05, 0.01), {(8, 4), (16, 64)}, "multiple"),
        ((0.05, 0.01), (0.05, 0.01), {(8, 4)}, "multiple"),
        ((0.028, 0.026), (0.028, 0.026), {(8, 4), (16, 64)}, "single"),
        ((0.035, 0.026), (0.035, 0.026), {(8, 4)}, "multiple"),  # by less than a cheaper model may add
    ],
)
def test_multiple_scattering_has_to_be_clearly_nearer(plume, draft, monkeypatch, coarse, fine, asked, model) -> None:
    """It finds half as dense a smoke for the same picture. Where coarse frames do not tell, finer ones are asked."""
    fitted_on = set()

    def known(frames, fitted, judge, settings) -> HeldOut:
        voxels = max(frames[0].scene.domain.resolution)
        fitted_on.add((voxels, settings.descent_iterations))
        errors = dict(zip(("single", "multiple"), coarse if voxels == 8 else fine, strict=True))
        return HeldOut(errors[judge] if fitted == judge else 0.4)

    monkeypatch.setattr("smokelift.setup.coarse.COARSE_SIDE", 8)
    monkeypatch.setattr(illumination, "held_out", known)
    choice = chosen(shot_of(plume.scene, draft), "scattering")
    assert (choice.value, fitted_on) == (model, asked)
    assert choice.figures["error_multiple"] == (fine if len(asked) == 2 else coarse)[1]


def test_thin_smoke_needs_no_shadows(thin, draft) -> None:
    choice = chosen(shot_of(thin, draft), "scattering")
    assert choice.value == "unshadowed"
    assert {"error_absorption", "error_unshadowed", "error_single", "error_multiple"} < set(choice.figures)


@pytest.mark.parametrize("model", ["absorption", "multiple"])
def test_scattering_by_hand_wins(plume, thin, draft, model) -> None:
    shot = shot_of(thin if model == "multiple" else plume.scene, replace(draft, scattering=model))
    choice = chosen(shot, "scattering")
    assert (shot.scene.scattering, choice.source, choice.figures) == (model, "given", {})


def test_a_backlit_silhouette_needs_no_light(plume, draft, tmp_path) -> None:
    """Dark smoke before a bright sky only absorbs, and the figures say that more would not be better."""
    sky = Background(color=(0.8, 0.9, 1.0))
    silhouette = blob(plume, tmp_path, Medium(25.0, 0.9), None, background=sky)
    shot = shot_of(silhouette, draft)
    choice = chosen(shot, "scattering")
    assert shot.scene.scattering == choice.value == "absorption"
    assert choice.figures["error_absorption"] <= choice.figures["error_unshadowed"] + choice.figures["tolerance"]
    assert (choice.kind, choice.figures["other"]) == ("compared scattering", "unshadowed")
    for model in ("single", "multiple"):
        with pytest.raises(ValueError, match=model):
            shot_of(silhouette, replace(draft, scattering=model))


def test_without_smoke_nothing_is_measured(plume, draft, tmp_path) -> None:
    shot = shot_of(plume.write(tmp_path, [0 * plume.densities[0]] * 3), draft)
    assert shot.scene.scattering == "single"
    assert "scattering" not in [choice.about for choice in shot.findings]


# environments


def test_an_environment_gets_its_directions(plume, draft, tmp_path) -> None:
    """The number is part of the scene from then on; by hand it is what is said."""
    write_image(tmp_path / "sky.exr", np.full((8, 16, 3), 0.5, np.float32), half=False)
    sky, draft = EnvironmentLight(tmp_path / "sky.exr"), replace(draft, scattering="unshadowed")
    coarse = replace(plume.scene.domain, resolution=(12, 12, 16))
    plain = replace(plume.scene.with_frames(1, 1), domain=coarse)
    (light,) = shot_of(replace(plain, lights=(sky,)), draft).scene.lights
    assert light == replace(sky, directions=light.directions) and light.directions >= 4
    scene = replace(plain, lights=(replace(sky, directions=6),))
    scene.save(tmp_path / "scene.toml")
    assert Scene.load(tmp_path / "scene.toml") == scene
    shot = shot_of(scene, draft)
    assert shot.scene.lights == scene.lights and len(shot.optics.lights) == 6


WHITE = np.ones(3)
RED, DUST = np.array((1.0, 0.3, 0.2)), np.array((1.0, 0.75, 0.48))
BLACK, SKY, BRICK = np.zeros(3), np.array((0.25, 0.45, 0.9)), np.array((0.2, 0.12, 0.08))
GREEN, PALE_SKY = np.array((0.0, 0.6, 0.01)), np.array((0.36, 0.42, 0.46))


def samples(source, behind, thickest=0.9):
    """Smoke of optical depths up to one before one color, with a little noise."""
    rng = np.random.default_rng(1)
    opacity = rng.random((500, 1)) * thickest
    behind = np.broadcast_to(behind, (500, 3))
    colors = (1 - opacity) * behind + opacity * source + 0.002 * rng.standard_normal((500, 3))
    return SmokeSamples(1.0, *np.ones((2, 1, 1), bool), colors.astype("f4"), behind.astype("f4"), (0,))


def apart(one, other):
    """Degrees between two colors."""
    return np.degrees(np.arccos(np.dot(one, other) / (np.linalg.norm(one) * np.linalg.norm(other))))


@pytest.mark.parametrize(
    ("source", "behind"), [(RED, BLACK), (RED, BRICK), (0.1 * RED, BLACK)], ids=["black", "brick", "dim"]
)
def test_a_color_of_its_own_is_found(source, behind):
    color, choice = smoke_color(samples(source, behind), WHITE)
    assert apart(color, RED) < 6
    assert max(color) == 1
    assert choice.source == "measured"


@pytest.mark.parametrize("thickest", [0.3, 0.9])
@pytest.mark.parametrize("behind", [BLACK, SKY, BRICK], ids=["black", "sky", "brick"])
@pytest.mark.parametrize("source", [0.8 * WHITE, 0.02 * WHITE, BLACK], ids=["white", "soot", "black"])
def test_gray_smoke_stays_gray_before_anything(source, behind, thickest):
    color, choice = smoke_color(samples(source, behind, thickest), WHITE)
    assert (color, choice.value) == ((1, 1, 1), UNDETERMINED)


@pytest.mark.parametrize(
    ("source", "behind", "undetermined"),
    [((1.0, 0.9, 0.8), BLACK, True), (DUST, BLACK, False), (0.8 * DUST, 0.4 * DUST, True)],
    ids=["white balance", "dust", "in its surroundings' color"],
)
def test_what_light_explains_is_the_lights(source, behind, undetermined):
    assert (smoke_color(samples(np.array(source), behind), WHITE)[1].value == UNDETERMINED) == undetermined


def test_a_dark_side_is_not_colored():
    """Thick smoke in the sun, whose shadow is darker than it is: before a sky it takes away more than it adds."""
    rng = np.random.default_rng(2)
    seen = samples(BLACK, PALE_SKY, 0.0)
    opacity, lit = 1 - rng.random((500, 1)) ** 4, rng.random((500, 1))
    lit_smoke = (1 - opacity) * PALE_SKY + opacity * 0.4 * lit**3 * np.array((1.0, 0.92, 0.84))
    _, choice = smoke_color(replace(seen, colors=lit_smoke.astype("f4")), WHITE)
    assert choice.value == UNDETERMINED


def shredded():
    """Red smoke that is clipped where it is thick, with a shred of pale smoke that is not."""
    red, pale = samples(2 * RED, BLACK), samples(0.9 * WHITE, BLACK)
    colors = np.concatenate([np.minimum(red.colors, 1), pale.colors[:25]])
    return replace(red, colors=colors, behind=np.concatenate([red.behind, pale.behind[:25]]))


@pytest.mark.parametrize("seen", [shredded(), samples(RED, GREEN)], ids=["shred", "green screen"])
def test_the_source_has_a_color_that_the_pixels_show_together(seen):
    """The brightest of each channel may be other smoke, or the background, and together a color that none shows."""
    assert apart(source_radiance(seen), RED) < 12
    assert apart(np.percentile(seen.colors, 99, axis=0), RED) > 15
    if (seen.behind == 0).all():
        assert apart(smoke_color(seen, WHITE)[0], RED) < 6


def test_the_source_is_beyond_the_thickest_smoke():
    """Thin smoke before a background that is brighter in the one channel in which smoke is darker."""
    source = np.array((0.4, 0.3, 0.0))
    seen = samples(source, GREEN, 0.5)
    along = (seen.colors - GREEN) @ (source - GREEN)
    found = source_radiance(seen)
    assert (found - GREEN) @ (source - GREEN) > along.max()


def test_a_known_light_leaves_the_smoke_the_rest():
    light = np.array((1.0, 0.5, 0.3))
    assert smoke_color(samples(0.8 * light, BLACK), light)[1].value == UNDETERMINED
    assert apart(smoke_color(samples(0.8 * light * RED, BLACK), light)[0], RED) < 1


def two_kinds(one, other, behind=BLACK):
    """Smoke of two colors, as much of each."""
    parts = samples(one, behind), samples(other, behind)
    colors, grounds = (np.concatenate([getattr(part, name) for part in parts]) for name in ("colors", "behind"))
    return SmokeSamples(1.0, *np.ones((2, 1, 1), bool), colors, grounds, (0,))


def test_smoke_of_more_than_one_color_is_said():
    """One whose color changes from a frame to the next asks for other frames: no crop and no mask helps there."""
    seen = two_kinds(RED, np.array((0.2, 0.3, 1.0)))
    half = len(seen.colors) // 2
    mixed = np.random.default_rng(3).permutation(len(seen.colors))
    for samples_of, kind in (
        (seen, "smoke of several colors"),
        (replace(seen, counts=(half, half)), "smoke that changes its color"),
        (replace(seen, colors=seen.colors[mixed], counts=(half, half)), "smoke of several colors"),
    ):
        assert [found.kind for found in several_colors(samples_of)] == [kind]


@pytest.mark.parametrize(
    ("one", "other", "behind"),
    [
        (RED, 0.4 * RED, BLACK),  # lit more and less
        (WHITE, 0.8 * DUST, BLACK),  # warm and neutral light at once
        (np.array((0.1, 0.25, 0.9)), WHITE, BLACK),  # blue, and clipped where it is brightest
        (RED, WHITE, SKY),  # what is behind it has a color as well
    ],
    ids=["shaded", "mixed light", "clipped", "sky"],
)
def test_smoke_of_one_color_is_not_said_to_have_several(one, other, behind):
    both = two_kinds(one, other, behind)
    if behind is BLACK and other is WHITE:
        both.colors[500:] = 1.0
    assert several_colors(both) == []


@pytest.mark.parametrize(
    ("hot", "kind"),
    [
        (HotPixels(0.0003, 1.0, 0.0051), "possible fire"),
        (HotPixels(0.0, 0.0, 0.0051), "possible faint fire"),
        (HotPixels(0.0003, 0.3, 0.0001), None),
    ],
    ids=["few", "pale", "no more than elsewhere"],
)
def test_a_little_fire_is_a_hint_which_says_what_helps(plume, hot, kind) -> None:
    """A color that is given for a flame finds none without a pixel of fire's own colors."""
    nowhere = np.zeros((1, 1), np.bool_)
    samples = SmokeSamples(1.0, nowhere, nowhere, *np.zeros((2, 0, 3), np.float32), ())
    estimate = SimpleNamespace(samples=samples, fire=None, hot=hot)
    _, found = find_medium(plume.scene, estimate, plume.scene.camera, plume.scene.domain)
    assert [each.kind for each in found] == [kind] * (kind is not None)
