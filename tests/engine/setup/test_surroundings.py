"""Light from everywhere that casts shadows, where nothing tells the light."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from smokelift.footage.noise import lasting_noise
from smokelift.scene import Background, DirectionalLight, Medium, Scene
from smokelift.setup import surroundings
from smokelift.setup.choice import Choice
from smokelift.setup.light import light_doubts
from smokelift.setup.scattering import HeldOut
from smokelift.setup.shot import Shot
from smokelift.setup.surroundings import light_around
from tests.engine.setup.shots import shot_of

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


def scattering_of(shot: Shot) -> Choice[str]:
    (choice,) = (choice for choice in shot.choices if choice.what == "scattering")
    return choice


@pytest.fixture
def leaves(monkeypatch):
    """Makes light from everywhere leave given errors, by its strength over that of what is behind the smoke."""

    def of(errors: dict[float, float]) -> list[float]:
        tried = []

        def known(frames, *_) -> HeldOut:
            lights = frames[0].scene.lights
            radiance = 0.9 * np.sum([light.irradiance for light in lights], 0) / (4 * np.pi)
            strength = round(float(radiance.mean()) / BEHIND, 2)
            tried.append(strength)
            coloured = radiance[0] > 1.1 * radiance[2]
            return HeldOut(errors[strength] if coloured else 1.0, 1.0, np.array([1.2, 1.0, 0.8]))

        monkeypatch.setattr(surroundings, "held_out", known)
        return tried

    return of


def test_light_around_has_its_radiance_and_no_direction() -> None:
    """Thin smoke that scatters all light is as bright as what is behind it."""
    lights = light_around(np.array([0.2, 0.3, 0.4]))
    assert np.allclose(np.sum([light.irradiance for light in lights], 0) / (4 * np.pi), (0.2, 0.3, 0.4))
    assert np.allclose(np.sum([light.direction for light in lights], 0), 0)


def test_what_is_clearly_nearer_is_taken_in_the_colour_that_the_clip_asks_for(lit, draft, leaves) -> None:
    """The strength stays that of what is behind the smoke, and the direction undetermined."""
    tried = leaves({1.0: 0.02, 0.7: 0.015, 0.5: 0.015})
    shot = shot_of(unlit(lit), draft)
    choice, lights = scattering_of(shot), shot.scene.lights
    assert tried == [1.0, 1.0, 0.7, 0.7, 0.5, 0.5]
    assert shot.scene.scattering == choice.chosen == "single"
    assert choice.measured["error_single"] == 0.02
    assert "for want of a known one" in choice.reason
    radiance = 0.9 * np.sum([light.irradiance for light in lights], 0) / (4 * np.pi)
    assert radiance == pytest.approx(BEHIND * np.array([1.2, 1.0, 0.8]), rel=0.01)
    assert next(found.chosen for found in shot.choices if found.what == "light direction") == "undetermined"
    (note,) = (note for note in shot.notes if note.startswith("Light not given"))
    assert "comes from behind the smoke" in note
    assert "with shadows" in note


def test_a_weaker_light_has_to_be_nearer_by_the_tolerance(lit, draft, leaves) -> None:
    """Then it is taken, and no other."""
    leaves({1.0: 0.05, 0.7: 0.02, 0.5: 0.01})
    total = np.sum([light.irradiance for light in shot_of(unlit(lit), draft).scene.lights])
    assert 0.9 * total / (4 * np.pi) / 3 == pytest.approx(0.7 * BEHIND, rel=0.01)


def test_what_is_nearer_by_little_is_not_taken(lit, draft, leaves) -> None:
    """It is no special case of smoke without shadows: it has to be nearer by a quarter, and by the tolerance."""
    leaves(dict.fromkeys((1.0, 0.7, 0.5), 1.0))
    choice = scattering_of(shot_of(unlit(lit), draft))
    error = choice.measured[f"error_{choice.chosen}"]
    limit = min(0.75 * error, error - draft.selection.scattering_error)
    leaves(dict.fromkeys((1.0, 0.7, 0.5), limit + 0.001))
    assert scattering_of(shot_of(unlit(lit), draft)) == choice
    leaves(dict.fromkeys((1.0, 0.7, 0.5), limit - 0.001))
    assert scattering_of(shot_of(unlit(lit), draft)).chosen == "single"


def test_a_light_that_is_given_stays(lit, draft, leaves) -> None:
    """Only a light that nothing tells is replaced."""
    tried = leaves({})
    assert shot_of(lit, draft).scene.lights == lit.lights
    assert not tried


@pytest.mark.parametrize("light", [0.0, 0.4])
def test_dark_smoke_before_something_bright_stays_dark(plume, draft, tmp_path, light) -> None:
    """Black smoke, and smoke that is lit a little, would have to be very thick to be as dark in that light."""
    faint = DirectionalLight((-0.7, 0.6, -0.5), (light,) * 3)
    dark = replace(plume.scene, medium=Medium(6.0, 0.9), lights=(faint,), background=Background(color=(0.8, 0.9, 1.0)))
    shot = shot_of(unlit(plume.write(tmp_path, plume.densities, dark)), draft)
    assert shot.scene.scattering in ("absorption", "unshadowed")


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
    """Elsewhere other things may be what is left."""
    shown = np.linspace(0.1, 0.5, 300).reshape(100, 3) if behind is None else np.tile(behind, (100, 1))
    samples = SimpleNamespace(behind=shown)
    choice = Choice("scattering", "absorption", "", {"error_absorption": error, "error_unshadowed": error})
    notes = light_doubts(choice, samples, lasting_noise(noise / 255))
    assert bool(notes) == said
    assert all("[[lights]]" in note for note in notes)


def test_the_doubt_is_said_of_a_shot(lit, draft, leaves, monkeypatch) -> None:
    """Once, beside the light that is taken, and never of one that is given."""
    leaves(dict.fromkeys((1.0, 0.7, 0.5), 1.0))
    monkeypatch.setattr("smokelift.setup.light.DOUBTFUL", 0.01)
    doubts = [sum("likely wrong" in note for note in shot_of(scene, draft).notes) for scene in (unlit(lit), lit)]
    assert doubts == [1, 0]
