"""What a clip shows before anything else is known: here its exposure, which only the smoke shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.render import render
from smokelift.scene import DirectionalLight, Medium
from tests.engine.setup.shots import burning, flickering, shot_of

FLICKERS = "The exposure of the clip flickers by up to"


@pytest.mark.parametrize("scattering", ["single", "multiple"])
def test_exposure_is_not_taken_for_scattered_light(plume, draft, tmp_path, scattering) -> None:
    """Smoke in its brightest frame is brighter than light scattered once can be, and is so in no other."""
    (sun,) = plume.scene.lights
    scene = replace(plume.scene, medium=Medium(30.0, 0.9), lights=(sun.scaled(0.3),), scattering=scattering)
    shot = shot_of(flickering(plume, tmp_path, scene, 0.25), draft)
    assert shot.scene.scattering == scattering
    assert shot.scene.lights == scene.lights
    assert shot.exposure > 0.2
    assert any(note.startswith(FLICKERS) for note in shot.notes)


def test_exposure_that_flickers_is_evened_out_and_said(plume, draft, tmp_path) -> None:
    """From each frame to the next the shot's pictures change as those of a steady clip do."""
    scene = flickering(plume, tmp_path, plume.scene, 0.1)
    steady = flickering(plume, tmp_path / "steady", plume.scene, 0.0)
    uneven, even = shot_of(scene, draft), shot_of(steady, draft)
    assert any(note.startswith(FLICKERS) for note in uneven.notes)
    assert 0.08 < uneven.exposure < 0.15 and even.exposure == 0
    light = [[shot.observe(n)[0].image.sum() for n in range(8)] for shot in (uneven, even)]
    assert np.abs(np.diff(np.log(np.divide(*light)))).max() < 0.02


def test_fire_flickers_by_itself(plume, draft, tmp_path) -> None:
    """So the smoke that flickers with it is lit by it, and no exposure is taken out."""
    dim = replace(plume.scene, lights=(DirectionalLight((0.3, 0.5, -0.8), (2.5, 2.5, 2.5)),))
    seen = render(plume.densities[0], dim)
    flame = burning(0, seen) - seen
    scene = flickering(plume, tmp_path, dim, 0.1, lambda picture: picture + flame)
    shot = shot_of(replace(scene, lights=()), draft)
    assert shot.fire is not None
    assert not any(note.startswith(FLICKERS) for note in shot.notes)
