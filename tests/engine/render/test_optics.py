"""What lights the smoke of a scene: an environment becomes many simple lights, the same for every camera and frame."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.render import Optics, scene_optics, scene_renderer
from smokelift.render.optics import sampled_lights
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, PointLight, Scene, completed
from tests.engine.render.environments import sky

SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
LAMP = PointLight((4.0, -3.0, 5.0), (60.0, 50.0, 40.0))
DOMAIN = Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (8, 8, 8))
CAMERA = Camera.look_at((1.5, -3.0, 1.4), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(16, 12))
SCENE = completed(Scene(camera=CAMERA, domain=DOMAIN, medium=Medium(4.0, 0.8, 0.3), lights=(SUN,)))


def test_optics_are_those_of_the_scene() -> None:
    scene = replace(SCENE, scattering="unshadowed", lights=(SUN, LAMP))
    assert scene_optics(scene) == Optics(DOMAIN, scene.medium, (SUN, LAMP), "unshadowed")


def test_unshadowed_source_is_the_radiance_of_thin_smoke() -> None:
    domain = Domain((-0.1, -0.1, 0.4), (0.1, 0.1, 0.6), (1, 1, 1))
    medium = Medium(1e-3, 0.8, 0.0)
    optics = Optics(domain, medium, (SUN, PointLight((2.0, 0.0, 0.5), (4.0, 8.0, 12.0))), "unshadowed")
    through = Camera.look_at((0.0, -3.0, 0.5), (0.0, 0.0, 0.5), fov_y_degrees=1, size=(1, 1))
    renderer = optics.renderer(through, np.zeros(3, np.float32))
    image = renderer.image(np.ones((1, 1, 1), np.float32))
    opacity = 1 - float(np.exp(-1e-3 * 0.2))
    np.testing.assert_allclose(image[0, 0], opacity * optics.unshadowed_source(), rtol=1e-3)


def test_a_moving_camera_needs_a_frame() -> None:
    moving = replace(CAMERA, matrices=(CAMERA.matrix, CAMERA.matrix))
    with pytest.raises(ValueError):
        scene_renderer(replace(SCENE, camera=moving))


def test_an_environment_becomes_parallel_lights_in_its_place(light_of) -> None:
    first, *between, last = sampled_lights(replace(SCENE, lights=(LAMP, light_of(sky(), directions=9), SUN)))
    assert (first, last, len(between)) == (LAMP, SUN, 9)
    assert all(isinstance(light, DirectionalLight) for light in between)


def test_lights_do_not_change_while_the_camera_moves(light_of) -> None:
    away = Camera.look_at((0.0, -30.0, 1.0), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(64, 48))
    scene = replace(SCENE, lights=(light_of(sky()),))
    moving = replace(scene, camera=replace(CAMERA, matrices=(CAMERA.matrix, away.matrix)))
    assert sampled_lights(moving) == sampled_lights(scene)
