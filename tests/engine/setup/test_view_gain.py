"""Cameras of different exposure and white balance: what was done to one of them is found and undone."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift import render
from smokelift.output.images import write_image
from smokelift.scene import Background, ClipSource, Scene, View, orbit
from tests.engine.setup.shots import shot_of

BEHIND = 0.05
FRAMES = 3


@pytest.fixture(scope="module")
def filmed(plume, tmp_path_factory):
    """Returns scenes of a front and a side before grey, whose picture is multiplied by a gain a channel."""
    side = orbit(plume.scene.camera, plume.scene.domain, 90)
    grey = replace(plume.scene, background=Background(color=(BEHIND,) * 3))
    clear = [render(density, grey, side) for density in plume.densities[1 : 1 + FRAMES]]

    def scene(gain: tuple[float, float, float]) -> Scene:
        folder = tmp_path_factory.mktemp("exposed")
        for number, picture in enumerate(clear):
            write_image(folder / f"frame_{number:04d}.png", np.asarray(gain, np.float32) * picture)
        red, green, blue = (BEHIND * each for each in gain)
        clip = ClipSource(folder / "frame_####.png", fps=24.0, frames=(0, FRAMES - 1))
        view = View(side, clip, Background(color=(red, green, blue)))
        front = replace(plume.scene.clip, frames=(1, FRAMES))
        return replace(plume.scene, clip=front, views=(view,))

    return scene


def gains(shot):
    """What was found, by view."""
    return [choice for choice in shot.estimates if choice.what.startswith("gain of view")]


@pytest.mark.parametrize("gain", [(0.6, 0.6, 0.6), (1.4, 1.0, 0.8)], ids=["exposure", "white balance"])
def test_another_exposure_is_found_and_undone(filmed, draft, gain) -> None:
    shot = shot_of(filmed(gain), draft)
    (found,) = gains(shot)
    assert found.what == "gain of view 1"
    np.testing.assert_allclose([float(value) for value in found.value.split(", ")], gain, rtol=0.1)
    assert found.figures["error"] < found.figures["error_as_it_is"]
    plate = shot.views[1].plates.at(0).image
    np.testing.assert_allclose(plate.mean((0, 1)), BEHIND, rtol=0.1)
    brightest = shot.views[1].clip.frame(1).max((0, 1))
    untouched = shot_of(filmed((1.0, 1.0, 1.0)), draft).views[1].clip.frame(1).max((0, 1))
    np.testing.assert_allclose(brightest, untouched, rtol=0.1)


@pytest.mark.parametrize("gain", [1.0, 0.92])
def test_what_light_may_explain_is_left_alone(filmed, draft, gain) -> None:
    assert gains(shot_of(filmed((gain,) * 3), draft)) == []


def test_unknown_light_explains_more(filmed, draft) -> None:
    """A ratio that counts in known light may be the light's where that is taken to come from everywhere."""
    scene = filmed((1.28,) * 3)
    (found,) = gains(shot_of(scene, draft))
    assert float(found.value.split(",")[0]) == pytest.approx(1.28, rel=0.06)
    assert gains(shot_of(replace(scene, lights=()), draft)) == []
