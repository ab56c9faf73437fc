"""The public functions: exact, by the model that the scene says, with examples that run, strict about input."""

import doctest
from dataclasses import replace

import numpy as np
import pytest

from smokelift import render, render_gradient
from smokelift.render import Optics, scene_optics, scene_renderer
from smokelift.render import image as image_module
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, PointLight, Scene, completed

SHAPE = (14, 12, 16)
SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
SCENE = Scene(
    camera=Camera.look_at((0.3, -2.0, 0.9), (0.7, 0.6, 0.8), fov_y_degrees=50, size=(20, 22)),
    domain=Domain((0.0, 0.0, 0.0), (1.4, 1.2, 1.6), SHAPE),
    medium=Medium(4.0, 0.8, -0.4),
    lights=(SUN,),
)
COMPLETE = completed(SCENE)
LAMP = PointLight((4.0, -3.0, 5.0), (60.0, 50.0, 40.0))
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


def test_the_loss_and_its_gradient_are_those_of_the_image(density, target):
    loss, gradient, image = render_gradient(density, SCENE, target)
    assert loss == pytest.approx(np.sum((image.astype(np.float64) - target) ** 2), rel=1e-6)
    np.testing.assert_array_equal(image, render(density, SCENE))
    step = np.float32(1e-3) * np.sign(gradient) * (density > 0)
    after, before = (render_gradient(density + sign * step, SCENE, target)[0] for sign in (1, -1))
    assert after - before == pytest.approx(2 * float(np.sum(gradient * step, dtype=np.float64)), rel=1e-3)


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
    for smoke, scene in (
        (density, replace(SCENE, camera=None)),
        (density, replace(SCENE, domain=None)),
        (density[1:], SCENE),
        *((np.full(SHAPE, endless, np.float32), SCENE) for endless in (1e38, np.inf, np.nan)),
    ):
        with pytest.raises(ValueError):
            render(smoke, scene)
    for wanted in (target[1:], np.full_like(target, np.nan)):
        with pytest.raises(ValueError, match="target"):
            render_gradient(density, SCENE, wanted)


def test_optics_are_those_of_the_scene() -> None:
    scene = replace(COMPLETE, scattering="unshadowed", lights=(SUN, LAMP))
    assert scene_optics(scene) == Optics(scene.domain, scene.medium, (SUN, LAMP), "unshadowed")


def test_a_moving_camera_needs_a_frame() -> None:
    moving = replace(ASIDE, matrices=(ASIDE.matrix, ASIDE.matrix))
    with pytest.raises(ValueError):
        scene_renderer(replace(COMPLETE, camera=moving))
