"""Given lights that a clip contradicts become stronger, and this is said; others stay."""

from __future__ import annotations

from dataclasses import replace

import pytest

from smokelift.scene import CompleteScene, Medium, Scene, completed
from smokelift.setup import light_strength
from smokelift.setup.light_strength import scaled
from smokelift.setup.scattering import HeldOut
from smokelift.setup.settings import Settings
from tests.engine.setup.shots import shot_of


@pytest.fixture(scope="module")
def thick(plume, tmp_path_factory) -> Scene:
    """The blob, so thick that more smoke makes it no brighter."""
    (sun,) = plume.scene.lights
    scene = replace(plume.scene, medium=Medium(20.0, 0.9), lights=(sun.scaled(0.4),), scattering="multiple")
    return replace(plume.write(tmp_path_factory.mktemp("thick"), plume.densities, scene), scattering=None)


def strengths(scene: Scene, draft: Settings) -> tuple[float, list[str]]:
    """The light of the shot over the given one, and what is said of it."""
    shot = shot_of(scene, draft)
    said = [choice.reason for choice in shot.choices if choice.what == "light strength"]
    return shot.scene.lights[0].irradiance[0] / scene.lights[0].irradiance[0], said


def test_a_light_that_the_clip_does_not_contradict_stays(thick, draft) -> None:
    assert strengths(thick, draft) == (1.0, [])


def test_a_light_that_is_too_weak_becomes_stronger(thick, draft) -> None:
    """Between once and twice what was taken away, since thicker smoke makes up for some of it."""
    (sun,) = thick.lights
    factor, said = strengths(replace(thick, lights=(sun.scaled(0.4),)), draft)
    assert 1.5 < factor < 3.2
    assert said[0].startswith(f"Light: {factor:.2f} times as strong as given")


def test_a_light_is_not_blamed_because_thinner_smoke_fits_better(thick, draft, monkeypatch) -> None:
    """The less smoke, the simpler its picture: only densities that are too dark speak against a light."""
    (sun,) = thick.lights
    asked: dict[float, float] = {}

    def held_out(frames, *_) -> HeldOut:
        factor = frames[0].scene.lights[0].irradiance[0] / sun.irradiance[0]
        return HeldOut(0.08 / factor, asked.get(round(factor, 4), 1.0))

    monkeypatch.setattr(light_strength, "held_out", held_out)
    asked[1.0] = 1.02
    assert strengths(thick, draft) == (1.0, [])
    asked[1.0], asked[1.25] = 1.4, 1.1
    assert strengths(thick, draft)[0] == pytest.approx(1.5625)


def test_single_scattering_by_hand_blames_no_light(thick, draft) -> None:
    """It is darker than the clip because orders of scattering are missing."""
    assert strengths(replace(thick, scattering="single"), draft) == (1.0, [])


def test_lights_of_every_kind_are_scaled(plume) -> None:
    scene: CompleteScene = completed(plume.scene)
    (sun,) = scene.lights
    assert scaled(scene, 2.0).lights[0].irradiance == tuple(2 * value for value in sun.irradiance)
    assert scaled(scene, 1.0) is scene
