"""The public functions: exact, by the model that the scene says, with examples that run, strict about input."""

import doctest
from dataclasses import replace

import numpy as np
import pytest
import renderer_reference as reference

from smokelift import render, render_gradient
from smokelift.render import image as image_module
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, Scene, completed

SHAPE = (14, 12, 16)
SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
SCENE = Scene(
    camera=Camera.look_at((0.3, -2.0, 0.9), (0.7, 0.6, 0.8), fov_y_degrees=50, size=(20, 22)),
    domain=Domain((0.0, 0.0, 0.0), (1.4, 1.2, 1.6), SHAPE),
    medium=Medium(4.0, 0.8, -0.4),
    lights=(SUN,),
)
ASIDE = Camera.look_at((3.0, 0.2, 1.1), (0.7, 0.6, 0.8), fov_y_degrees=40, size=(18, 14))


@pytest.fixture(scope="module")
def density():
    rng = np.random.default_rng(3)
    return (rng.random(SHAPE) * (rng.random(SHAPE) > 0.4)).astype(np.float32)


@pytest.fixture(scope="module")
def target():
    return np.random.default_rng(4).random((22, 20, 3)).astype(np.float32)


def test_examples_of_the_documentation_run():
    assert doctest.testmod(image_module).failed == 0


@pytest.mark.parametrize("scattering", ["single", "unshadowed", "absorption"])
def test_render_gradient_of_every_model(density, target, scattering):
    scene = replace(SCENE, scattering=scattering)
    loss, gradient, image = render_gradient(density, scene, target)
    assert loss == pytest.approx(np.sum((image.astype(np.float64) - target) ** 2), rel=1e-6)
    np.testing.assert_array_equal(image, render(density, scene))

    def exact(values):
        shown = reference.render(values, scene.camera, scene.domain, scene.medium, (SUN,), np.zeros(3), scattering)
        return np.sum((shown - target) ** 2)

    for voxel in np.random.default_rng(7).choice(np.argwhere(density > 0), 3, replace=False):
        expected = reference.complex_step(exact, density, voxel)
        assert gradient[tuple(voxel)] == pytest.approx(expected, rel=1e-3, abs=1e-6 * float(np.abs(gradient).max()))


def test_losses_of_several_views_add_up(density, target):
    other = np.zeros((14, 18, 3), np.float32)
    loss, gradient, images = render_gradient(density, SCENE, [target, other], [SCENE.camera, ASIDE])
    one = render_gradient(density, SCENE, target)
    two = render_gradient(density, SCENE, other, ASIDE)
    assert loss == one[0] + two[0]
    np.testing.assert_array_equal(gradient, one[1] + two[1])
    for found, expected in zip(images, (one[2], two[2]), strict=True):
        np.testing.assert_array_equal(found, expected)
    with pytest.raises(ValueError):
        render_gradient(density, SCENE, [target], [SCENE.camera, ASIDE])


def test_a_complete_scene_shows_the_same_as_its_description(density):
    np.testing.assert_array_equal(render(density, completed(SCENE)), render(density, SCENE))
    np.testing.assert_array_equal(render(density, completed(SCENE), ASIDE), render(density, SCENE, ASIDE))
    without = replace(SCENE, camera=None)
    np.testing.assert_array_equal(render(density, without, ASIDE), render(density, SCENE, ASIDE))


def test_incomplete_scenes_and_other_shapes_are_refused(density, target):
    with pytest.raises(ValueError):
        render(density, replace(SCENE, camera=None))
    with pytest.raises(ValueError):
        render(density, replace(SCENE, domain=None))
    with pytest.raises(ValueError):
        render(density[1:], SCENE)
    with pytest.raises(ValueError):
        render_gradient(density, SCENE, target[1:])
    with pytest.raises(ValueError):
        render_gradient(density, SCENE, np.full_like(target, np.nan))
