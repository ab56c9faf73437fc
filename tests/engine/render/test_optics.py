"""What lights the smoke of a scene, put into one value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.render import Optics, scene_optics, scene_renderer
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, PointLight, Scene, completed

SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
DOMAIN = Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (8, 8, 8))
CAMERA = Camera.look_at((1.5, -3.0, 1.4), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(16, 12))
SCENE = completed(Scene(camera=CAMERA, domain=DOMAIN, medium=Medium(4.0, 0.8, 0.3), lights=(SUN,)))


def test_optics_are_those_of_the_scene() -> None:
    scene = replace(SCENE, scattering="unshadowed")
    assert scene_optics(scene) == Optics(DOMAIN, scene.medium, (SUN,), "unshadowed")


def test_unshadowed_source_is_the_radiance_of_thin_smoke() -> None:
    """Before black, isotropic, one voxel in the middle: picture = source times opacity."""
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
    with pytest.raises(ValueError, match="The camera moves; give the one of a frame"):
        scene_renderer(replace(SCENE, camera=moving))
