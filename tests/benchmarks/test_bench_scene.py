"""The benchmark's scene: as much smoke as it says, as thick as it says, and light as it says."""

import numpy as np
import pytest

from benchmarks.renderer.scene import OPTICAL_DEPTH, PLUME, bench_scene, plume


def picture(size: int) -> np.ndarray:
    return np.zeros((size, size, 3), np.float32)


def test_optical_depth():
    scene = bench_scene(plume(32, PLUME), picture(32))
    depth = scene.medium.extinction * scene.density.sum(1).max() * scene.domain.voxel_size
    assert depth == pytest.approx(OPTICAL_DEPTH)


def test_many_lights_have_the_power_of_one_and_come_from_above():
    one, many = (bench_scene(plume(8, 1.0), picture(8), count) for count in (1, 16))
    assert len(many.lights) == 16
    total = np.sum([light.irradiance for light in many.lights], 0)
    np.testing.assert_allclose(total, one.light.irradiance)
    assert all(light.direction[2] < 0 for light in many.lights)
