"""Depth from lamps of different colours: found where they show it, left alone where they do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.density import Observation
from smokelift.density.axis import AxisEstimate, SmokeAxis
from smokelift.density.axis_from_light import refine_axis
from smokelift.density.hull import voxel_centres
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import EIGHT_BIT_NOISE
from smokelift.footage.plate import Plate
from smokelift.render import render, scene_optics
from smokelift.scene import Background, Camera, DirectionalLight, Domain, Medium, PointLight, Scene, completed

RED, BLUE, GREY = (36.0, 18.0, 6.0), (6.0, 18.0, 36.0), (20.0, 20.0, 20.0)
FRONT, BACK, LEFT = (-1.2, -1.9, 2.3), (1.2, 1.9, 2.3), (-2.2, 0.0, 2.3)
SCENE = Scene(
    camera=Camera.look_at((0, -7, 1), (0, 0, 1), fov_y_degrees=18, size=(32, 32)),
    domain=Domain((-1, -1, 0), (1, 1, 2), (32, 32, 32)),
    medium=Medium(extinction=1.5, albedo=0.9),
    lights=(PointLight(FRONT, RED), PointLight(BACK, BLUE)),
    background=Background(color=(0.0, 0.0, 0.0)),
)


UNKNOWN = AxisEstimate(SmokeAxis.upright(), "box", 0.0, 0.15)


def column(depth: float, lean: float) -> np.ndarray:
    """Smoke that is soft at its edge, half a metre and more from floor and ceiling."""
    x, y, z = np.moveaxis(voxel_centres(SCENE.domain), -1, 0)
    z = z - 1
    inside = np.clip(1.5 - np.hypot(x, y - depth - lean * z) / 0.2, 0, 1) * np.clip(5 * (0.5 - np.abs(z)), 0, 1)
    return inside.astype(np.float32)


def found(scene: Scene, depth: float, lean: float = 0.0) -> tuple[AxisEstimate, AxisEstimate]:
    """What is known before and after a look at an 8-bit picture."""
    picture = linear_to_srgb(render(column(depth, lean), scene))
    picture = srgb_to_linear(np.rint(255 * picture) / 255).astype(np.float32)
    plate = Plate(np.zeros_like(picture), np.ones(picture.shape[:2], np.float32), EIGHT_BIT_NOISE)
    before = UNKNOWN
    optics = scene_optics(completed(scene))
    return before, refine_axis(before, [Observation(scene.camera, picture, plate)], optics)


@pytest.mark.parametrize("depth", [-0.25, 0.3])
def test_lamps_before_and_behind_show_the_depth(depth) -> None:
    """What is redder is nearer to the red lamp."""
    _, estimate = found(SCENE, depth)
    assert estimate.cue == "lamps" and abs(estimate.depth - depth) < 2 * estimate.deviation < 0.2
    assert estimate.axis.at(np.array([0.0]))[0] == pytest.approx(depth, abs=0.1)


def test_lamps_before_and_behind_show_the_lean() -> None:
    """Top and bottom of a column that leans away are lit by different lamps."""
    _, estimate = found(SCENE, 0.0, lean=0.4)
    low, high = estimate.axis.at(np.array([-0.4, 0.4]))
    assert high - low == pytest.approx(0.8 * 0.4, abs=0.15)


@pytest.mark.parametrize(
    "lights",
    [
        (PointLight(FRONT, GREY), PointLight(BACK, GREY)),
        (PointLight(FRONT, RED), PointLight((-1.1, -1.9, 2.3), BLUE)),
        (PointLight(LEFT, RED), PointLight((2.2, 0.1, 2.3), BLUE)),
        (DirectionalLight((0, 0.7, -0.7), RED), DirectionalLight((0, -0.7, -0.7), BLUE)),
        (PointLight(FRONT, RED), DirectionalLight((0, -0.7, -0.7), BLUE)),
        (),
    ],
    ids=["one colour", "one place", "left and right", "parallel", "one lamp", "none"],
)
def test_other_lights_say_nothing(lights) -> None:
    """What is known is what it was."""
    before, after = found(replace(SCENE, lights=lights), 0.3)
    assert after is before


def test_no_pictures_say_nothing() -> None:
    """Nothing to look at, or nothing in it."""
    optics = scene_optics(completed(SCENE))
    assert refine_axis(UNKNOWN, [], optics) is UNKNOWN
    black = Observation(SCENE.camera, np.zeros((32, 32, 3), np.float32))
    assert refine_axis(UNKNOWN, [black], optics) is UNKNOWN
