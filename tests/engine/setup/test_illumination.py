"""The light of a shot: what is given stays unless the clip contradicts it, and what is not is taken from the clip."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from smokelift.checks import Doubt
from smokelift.footage.clip import Clip
from smokelift.footage.noise import lasting_noise
from smokelift.scene import Background, DirectionalLight, Medium, Scene
from smokelift.setup import illumination
from smokelift.setup.estimate import Estimate
from smokelift.setup.held_out import HeldOut
from smokelift.setup.illumination import Illumination, light_remarks
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot
from smokelift.setup.sky import light_around
from tests.engine.setup.shots import shot_of

# a light that is not given


def test_brightening_smoke_has_a_bright_source(plume, draft) -> None:
    shot = shot_of(replace(plume.scene, lights=()), draft)
    with Clip.open(plume.scene.clip) as clip:
        brightest = max(float(frame.max()) for frame in clip)
    source = shot.scene.medium.albedo / (4 * np.pi) * np.array(shot.scene.lights[0].irradiance)
    assert 0.7 * brightest < source.max() < 1.5 * brightest


def test_darkening_smoke_has_a_dark_source(plume, draft, tmp_path) -> None:
    """Before a bright wall, thick dark smoke looks no brighter than the darkest smoke in the clip."""
    sooty = replace(
        plume.scene,
        medium=Medium(extinction=8.0, albedo=0.3),
        lights=(DirectionalLight((0, 0.5, -0.8), (2.0, 2.0, 2.0)),),
        background=Background(color=(0.8, 0.8, 0.8)),
    )
    scene = plume.write(tmp_path / "clip", plume.densities, sooty)
    shot = shot_of(replace(scene, lights=()), draft)
    with Clip.open(scene.clip) as clip:
        darkest = min(float(frame.min()) for frame in clip)
    source = 0.3 / (4 * np.pi) * np.array(shot.scene.lights[0].irradiance)
    assert source.max() <= 1.1 * darkest
    assert source.max() < 0.4


# given lights


@pytest.fixture(scope="module")
def thick(plume, tmp_path_factory) -> Scene:
    """The blob, so thick that more smoke makes it no brighter."""
    (sun,) = plume.scene.lights
    scene = replace(plume.scene, medium=Medium(20.0, 0.9), lights=(sun.scaled(0.4),), scattering="multiple")
    return replace(plume.write(tmp_path_factory.mktemp("thick"), plume.densities, scene), scattering=None)


def strengths(scene: Scene, draft: Settings) -> tuple[float, list[float]]:
    """The light of the shot over the given one, and the factors that are said of it."""
    shot = shot_of(scene, draft)
    said = [estimate.figures["factor"] for estimate in shot.estimates if estimate.what == "light strength"]
    return shot.scene.lights[0].irradiance[0] / scene.lights[0].irradiance[0], said


def test_a_light_that_the_clip_does_not_contradict_stays(thick, draft) -> None:
    assert strengths(thick, draft) == (1.0, [])


def test_a_light_that_is_too_weak_becomes_stronger(thick, draft) -> None:
    (sun,) = thick.lights
    factor, said = strengths(replace(thick, lights=(sun.scaled(0.4),)), draft)
    assert 1.5 < factor < 3.2
    assert said == [pytest.approx(factor)]


def test_a_light_is_not_blamed_because_thinner_smoke_fits_better(thick, draft, monkeypatch) -> None:
    """The less smoke, the simpler its picture: only densities that are too dark speak against a light."""
    (sun,) = thick.lights
    asked: dict[float, float] = {}

    def held_out(frames, *_) -> HeldOut:
        factor = frames[0].scene.lights[0].irradiance[0] / sun.irradiance[0]
        return HeldOut(0.08 / factor, asked.get(round(factor, 4), 1.0))

    monkeypatch.setattr(illumination, "held_out", held_out)
    asked[1.0] = 1.02
    assert strengths(thick, draft) == (1.0, [])
    asked[1.0], asked[1.25] = 1.4, 1.1
    assert strengths(thick, draft)[0] == pytest.approx(1.5625)


# light from everywhere with shadows

BEHIND = 0.4


@pytest.fixture(scope="module")
def lit(plume, tmp_path_factory) -> Scene:
    """The blob, thick, in a sun from the side, before something that is brighter than most of it."""
    sun = DirectionalLight((-0.7, 0.6, -0.5), (6.0, 5.5, 5.0))
    scene = replace(plume.scene, medium=Medium(20.0, 0.9), lights=(sun,), background=Background(color=(BEHIND,) * 3))
    return plume.write(tmp_path_factory.mktemp("lit"), plume.densities, scene)


def unlit(scene: Scene) -> Scene:
    """The same clip, of which neither light nor medium is known."""
    return replace(scene, lights=(), medium=None)


def scattering_of(shot: Shot) -> Estimate[str]:
    (choice,) = (choice for choice in shot.estimates if choice.what == "scattering")
    return choice


@pytest.fixture
def leaves(monkeypatch):
    """Makes light from everywhere leave a given error; returns its strengths over that of what is behind the smoke."""

    def of(error: float) -> list[float]:
        tried = []

        def known(frames, _, judge, __) -> HeldOut:
            if judge == "multiple":  # of given lights
                return HeldOut(1.0)
            lights = frames[0].scene.lights
            radiance = 0.9 * np.sum([light.irradiance for light in lights], 0) / (4 * np.pi)
            tried.append(round(float(radiance.mean()) / BEHIND, 2))
            coloured = radiance[0] > 1.1 * radiance[2]
            return HeldOut(error if coloured else 1.0, 1.0, np.array([[1.2, 1.0, 0.8]]))

        monkeypatch.setattr(illumination, "held_out", known)
        return tried

    return of


def test_what_is_clearly_nearer_is_taken_in_the_colour_that_the_clip_asks_for(lit, draft, leaves) -> None:
    tried = leaves(0.02)
    shot = shot_of(unlit(lit), draft)
    choice, lights = scattering_of(shot), shot.scene.lights
    assert tried == [1.0, 1.0]
    assert shot.scene.scattering == choice.value == "single"
    assert choice.figures["error_single"] == 0.02
    assert choice.kind == "scattering in light from everywhere"
    radiance = 0.9 * np.sum([light.irradiance for light in lights], 0) / (4 * np.pi)
    assert radiance == pytest.approx(BEHIND * np.array([1.2, 1.0, 0.8]), rel=0.01)
    assert next(found.value for found in shot.estimates if found.what == "light direction") == "undetermined"
    assert "light as behind the smoke" in [remark.kind for remark in shot.remarks]


def test_what_is_nearer_by_little_is_not_taken(lit, draft, leaves) -> None:
    """It is no special case of smoke without shadows: it has to be nearer by a quarter, and by the tolerance."""
    leaves(1.0)
    choice = scattering_of(shot_of(unlit(lit), draft))
    error = choice.figures[f"error_{choice.value}"]
    limit = min(0.75 * error, error - draft.selection.scattering_error)
    leaves(limit + 0.001)
    assert scattering_of(shot_of(unlit(lit), draft)) == choice
    leaves(limit - 0.001)
    assert scattering_of(shot_of(unlit(lit), draft)).value == "single"


def test_a_light_that_is_given_stays(lit, draft, leaves) -> None:
    tried = leaves(1.0)
    assert shot_of(lit, draft).scene.lights == lit.lights
    assert not tried


@pytest.mark.parametrize(
    ("error", "behind", "noise", "said"),
    [
        (0.13, (0.4, 0.4, 0.4), 1, True),
        (0.11, (0.4, 0.4, 0.4), 1, False),
        (0.13, (0.003, 0.003, 0.003), 1, False),
        (0.13, (0.4, 0.4, 0.4), 5, False),
        (0.13, None, 1, False),
    ],
    ids=["one colour", "well explained", "black", "noise", "a wall"],
)
def test_a_light_that_explains_little_before_one_colour_is_said_to_be_wrong(error, behind, noise, said) -> None:
    shown = np.linspace(0.1, 0.5, 300).reshape(100, 3) if behind is None else np.tile(behind, (100, 1))
    samples = SimpleNamespace(behind=shown, smoky=(0,))
    choice = Estimate(
        "scattering", {"error_absorption": error}, what="scattering", value="absorption", source="measured"
    )
    unknown = Estimate("unknown", what="smoke thickness", value="undetermined", source="assumed")
    light = Illumination(light_around(np.ones(3)), "absorption", "assumed", False, (choice,), unknown, unknown)
    for burns, kind in ((False, "likely wrong light"), (True, "light of fire")):
        _, *doubts = light_remarks(light, samples, lasting_noise(noise / 255), burns=burns)
        assert doubts == [Doubt(kind, {"error": error})] * said
