"""Smoke that wanders in depth: by how much, that it travels, and what stays as it is."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift import Camera, Domain, Scene
from smokelift.density import Observation, RoundDepth, ViewSet
from smokelift.density.observation import eight_bit_plate
from smokelift.density.wander import DEVIATION, Wander
from smokelift.render import render, scene_optics
from smokelift.scene import Background, Medium, completed

WANDER = Wander(np.array([0.0, 0.0, 2.5]), 5.0, (0.8, 0.6, 0.4), 1)
PLANE = np.stack(np.meshgrid(np.arange(160.0), np.arange(80.0), indexing="ij"))

SCENE = Scene(
    camera=Camera.look_at((0, -8, 0.75), (0, 0, 0.75), fov_y_degrees=14, size=(32, 48)),
    domain=Domain((-0.5, -0.5, 0), (0.5, 0.5, 1.5), (32, 32, 48)),
    medium=Medium(extinction=2),
    background=Background(color=(1.0, 1.0, 1.0)),
    scattering="absorption",
)


def column() -> np.ndarray:
    """A straight column (nx, ny, nz)."""
    x, y, _ = SCENE.domain.offsets(SCENE.domain.centre)
    return np.broadcast_to(np.exp(-(((x**2 + y**2) / 0.03) ** 2)), SCENE.domain.resolution).astype(np.float32)


def spread_by(prior: RoundDepth, cameras: tuple[Camera, ...] = (SCENE.camera,), frame: int = 0) -> np.ndarray:
    """The density that a prior finds for the column's pictures."""
    pictures = [render(column(), replace(SCENE, camera=camera)) for camera in cameras]
    plate = eight_bit_plate(np.ones(3, np.float32), SCENE.camera.size)
    seen = [Observation(camera, picture, plate) for camera, picture in zip(cameras, pictures, strict=True)]
    return prior.estimate(ViewSet.of(seen, scene_optics(completed(SCENE)), frame)).density


def middles(density: np.ndarray) -> np.ndarray:
    """Mean depth (voxels) of the rays (lateral, height) through the column."""
    part = density[13:19, :, 8:40].astype(np.float64)
    return np.asarray(np.einsum("xyz,y->xz", part, np.arange(density.shape[1])) / part.sum(1))


def depth(density: np.ndarray) -> float:
    """Standard deviation (voxels) of the column's smoke in depth."""
    row = density[13:19, :, 8:40].sum((0, 2), dtype=np.float64)
    places = np.arange(len(row))
    middle = places @ row / row.sum()
    return float(np.sqrt((places - middle) ** 2 @ row / row.sum()))


def test_middles_scatter_as_much_as_the_pictures_are_rough() -> None:
    scatter = np.stack([replace(WANDER, seed=seed).offset(PLANE) for seed in range(8)])
    assert WANDER.deviation == pytest.approx(DEVIATION * np.hypot(0.8, 0.6))
    assert scatter.std((1, 2)).mean() == pytest.approx(WANDER.deviation, rel=0.15)
    assert np.abs(np.diff(scatter, axis=0)).max((1, 2)).min() > 0.5, "another seed wanders otherwise"


def test_scatter_travels_with_the_smoke() -> None:
    frame = 6
    height = 0.75 + frame * WANDER.velocity[2] * SCENE.domain.voxel_size
    risen = Camera.look_at((0, -8, height), (0, 0, height), fov_y_degrees=14, size=SCENE.camera.size)
    now, later = (
        WANDER.scatter(camera, SCENE.domain, number).offset for camera, number in ((SCENE.camera, 0), (risen, frame))
    )
    np.testing.assert_allclose(later, now, atol=1e-4)


def test_laminar_smoke_stands_straight() -> None:
    straight = replace(WANDER, roughness=(0.0, 0.0))
    np.testing.assert_array_equal(spread_by(RoundDepth(wander=straight)), spread_by(RoundDepth()))


def test_wandering_smoke_is_as_deep_as_smoke_that_stands_on_the_axis() -> None:
    round_smoke = spread_by(RoundDepth())
    found = [spread_by(RoundDepth(wander=replace(WANDER, seed=seed))) for seed in range(16)]
    assert middles(round_smoke).std() < 0.2
    assert np.mean([middles(each).std() for each in found]) > 0.6 * WANDER.deviation * depth(round_smoke)
    assert np.mean([depth(each) for each in found]) == pytest.approx(depth(round_smoke), rel=0.1)


def test_smoke_that_two_cameras_see_stands_where_they_show_it() -> None:
    both = (SCENE.camera, Camera.look_at((8, 0, 0.75), (0, 0, 0.75), fov_y_degrees=14, size=(32, 48)))
    np.testing.assert_array_equal(spread_by(RoundDepth(wander=WANDER), both), spread_by(RoundDepth(), both))
