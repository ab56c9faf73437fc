"""The benchmark's right answers, against a second restatement of the same sums and its derivative by complex step."""

import numpy as np
import pytest

from benchmarks.renderer import reference
from benchmarks.renderer.scene import BenchScene, bench_scene, plume
from tests.engine.renderer_reference import render

SIZE = 8


@pytest.fixture(params=[0.18, 1.0], ids=["plume", "full"])
def scene(request) -> BenchScene:
    """Both scenes; the target is a picture of noise."""
    target = np.random.default_rng(0).random((SIZE, SIZE, 3), np.float32)
    return bench_scene(plume(SIZE, request.param), target)


def other(scene: BenchScene, density: np.ndarray) -> np.ndarray:
    return render(density, scene.camera, scene.domain, scene.medium, scene.lights, np.array(scene.background))


def test_image_is_that_of_the_other_restatement(scene):
    image, _ = reference.image_and_gradient(scene)
    np.testing.assert_allclose(image, other(scene, scene.density.astype(float)), rtol=1e-12)
    np.testing.assert_array_equal(image, reference.image(scene))


def test_gradient_is_the_derivative_by_complex_step(scene):
    image, gradient = reference.image_and_gradient(scene)
    smoke = scene.density > 0
    random = np.random.default_rng(1)
    directions = [random.standard_normal(smoke.shape) * smoke for _ in range(4)]
    for voxel in random.choice(np.flatnonzero(smoke), 20, replace=False):
        one = np.zeros(smoke.size)
        one[voxel] = 1
        directions.append(one.reshape(smoke.shape))
    for direction in directions:
        slope = other(scene, scene.density + 1e-30j * direction).imag / 1e-30
        expected = np.sum(2 * (image - scene.target) * slope)
        assert np.sum(gradient * direction) == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(gradient).max())
