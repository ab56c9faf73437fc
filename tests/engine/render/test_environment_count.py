"""The number of lights for an environment: as many as it takes, and no more."""

from __future__ import annotations

import numpy as np

from smokelift.render import Renderer
from smokelift.render.environment import environment_lights
from smokelift.render.environment_count import environment_count
from smokelift.scene import Camera, Domain, Medium
from tests.engine.render.environments import sky

DOMAIN = Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.5), (64, 64, 96))
CAMERA = Camera.look_at((1.5, -3.0, 1.4), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(640, 480))


def test_a_black_picture_takes_the_least(light_of) -> None:
    assert environment_count(light_of(np.zeros((4, 8, 3))), CAMERA, DOMAIN, Medium()) == 4


def test_the_count_follows_the_scene(light_of) -> None:
    """A lamp needs no more than the least, a sky more, and a medium that scatters forward most."""
    lamp = np.zeros((64, 128, 3))
    lamp[10, 20] = 1
    medium, forward = Medium(2.0, 0.9, 0.0), Medium(2.0, 0.9, 0.6)
    assert environment_count(light_of(lamp), CAMERA, DOMAIN, forward) == 4
    least = environment_count(light_of(sky()), CAMERA, DOMAIN, medium)
    assert 8 <= least < environment_count(light_of(sky()), CAMERA, DOMAIN, forward) <= 256


def test_the_count_does_not_depend_on_units(light_of) -> None:
    """Nor on the size of the footage: it is the medium's shape and the camera's place that matter."""
    light = light_of(sky())
    wanted = environment_count(light, CAMERA, DOMAIN, Medium(2.0, 0.9, 0.2))
    assert environment_count(light, CAMERA.resized(1920, 1440), DOMAIN, Medium(200.0, 0.9, 0.2)) == wanted
    assert environment_count(light_of(100 * sky()), CAMERA, DOMAIN, Medium(2.0, 0.3, 0.2)) == wanted


def test_the_count_is_enough(light_of, plume) -> None:
    """On other smoke than it is chosen with: within 1 % of 256 lights."""
    domain, camera, density = plume.scene.domain, plume.scene.camera, plume.densities[0]
    medium = Medium(8.0, 0.9, 0.3)
    light = light_of(sky())
    count = environment_count(light, camera, domain, medium)
    assert count < 256
    few, many = (picture(environment_lights(light, number), camera, domain, medium, density) for number in (count, 256))
    assert np.linalg.norm(few - many) < 0.01 * np.linalg.norm(many)


def picture(lights, camera, domain, medium, density) -> np.ndarray:
    black = np.zeros(3, np.float32)
    return Renderer(camera, domain, medium, lights, black).image(density)
