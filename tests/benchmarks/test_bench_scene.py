"""The benchmark's scene: as much smoke as it says, as thick as it says, and light as it says."""

import numpy as np
import pytest

from benchmarks.renderer.scene import OPTICAL_DEPTH, PLUME, bench_scene, plume


def picture(size: int) -> np.ndarray:
    return np.zeros((size, size, 3), np.float32)


@pytest.mark.parametrize("size", [32, 64])
@pytest.mark.parametrize("share", [0.05, PLUME, 0.6])
def test_share_of_voxels_with_smoke(size, share):
    density = plume(size, share)
    assert density.dtype == np.float32
    assert np.mean(density > 0) == pytest.approx(share, abs=0.0005)
    assert np.all(density >= 0)


def test_full_scene_has_smoke_everywhere_and_no_support():
    density = plume(16, 1.0)
    assert density.min() > 0.1
    assert bench_scene(density, picture(16)).support is None


def test_plume_is_one_piece_in_the_middle_with_structure():
    density = plume(32, PLUME)
    assert density[16, 16, 16] > 0
    for side in (density[0], density[-1], density[:, 0], density[:, -1]):
        assert not side.any()
    assert np.array_equal(bench_scene(density, picture(32)).support, density > 0)
    assert np.std(density[12:20, 12:20, 12:20]) > 0.1


def test_optical_depth():
    scene = bench_scene(plume(32, PLUME), picture(32))
    depth = scene.medium.extinction * scene.density.sum(1).max() * scene.domain.voxel_size
    assert depth == pytest.approx(OPTICAL_DEPTH)


def test_light_is_45_degrees_high_and_along_no_axis():
    direction = np.array(bench_scene(plume(8, 1.0), picture(8)).light.direction)
    assert np.degrees(np.arcsin(-direction[2])) == pytest.approx(45)
    assert np.abs(direction).min() > 0.3


def test_many_lights_have_the_power_of_one_and_come_from_above():
    one, many = (bench_scene(plume(8, 1.0), picture(8), count) for count in (1, 16))
    assert len(many.lights) == 16
    total = np.sum([light.irradiance for light in many.lights], 0)
    np.testing.assert_allclose(total, one.light.irradiance)
    assert all(light.direction[2] < 0 for light in many.lights)
