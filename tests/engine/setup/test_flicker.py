"""Exposure that goes up and down from frame to frame is told from smoke that changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.output.images import write_image
from smokelift.render import render
from smokelift.scene import ClipSource, Medium, Scene
from smokelift.setup.flicker import beside_others, exposure_of
from tests.engine.setup.shots import shot_of

GROWING = 2.0 + 0.1 * np.arange(12)
UP_AND_DOWN = 1 + 0.1 * (-1.0) ** np.arange(12)


@pytest.mark.parametrize("number", range(12))
def test_the_exposure_of_every_frame_is_found(number) -> None:
    """At the ends of a clip too, while the smoke grows; nothing is said of light that only grows."""
    lights = GROWING * UP_AND_DOWN
    assert exposure_of(number, 12, lights.__getitem__) == pytest.approx(UP_AND_DOWN[number], abs=0.01)
    assert exposure_of(number, 12, GROWING.__getitem__) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize(
    "lights", [[0, 0, 1, 1, 1], [1, 1, 1, 0.2, 0], [1, 1.1, 1.3, 1.1, 0.8], [0, 0, 0, 0, 0], [1, 2, 4, 8, 16]]
)
def test_smoke_that_appears_fades_or_bursts_is_no_flicker(lights) -> None:
    """It goes up or down once."""
    assert [beside_others(lights, at) for at in range(5)] == [1.0] * 5


def test_three_frames_do_not_tell() -> None:
    """They go up and down once, as the smoke may."""
    assert exposure_of(1, 3, [1.0, 1.2, 1.0].__getitem__) == 1.0


def flickering(plume, folder, scene: Scene, share: float) -> Scene:
    """The clip of a scene whose exposure goes up and down."""
    for number, density in enumerate(plume.densities):
        picture = np.float32(1 + share * (-1.0) ** number) * render(density, scene)
        write_image(folder / f"frame_{number}.exr", picture, half=False)
    return replace(scene, clip=ClipSource(folder / "frame_#.exr", fps=24.0), scattering=None)


@pytest.mark.parametrize("scattering", ["single", "multiple"])
def test_exposure_is_not_taken_for_scattered_light(plume, draft, tmp_path, scattering) -> None:
    """Smoke in its brightest frame is brighter than light scattered once can be, and is so in no other."""
    (sun,) = plume.scene.lights
    scene = replace(plume.scene, medium=Medium(30.0, 0.9), lights=(sun.scaled(0.3),), scattering=scattering)
    shot = shot_of(flickering(plume, tmp_path, scene, 0.25), draft)
    assert shot.scene.scattering == scattering
    assert shot.scene.lights == scene.lights
