"""The turntable: its cameras see the domain turned, and its screen shows a camera's picture."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.density.turntable import Turntable
from smokelift.scene import Camera, Domain, orbit
from smokelift.scene.projection import project

DOMAIN = Domain((-0.6, -0.4, 0.0), (0.6, 0.4, 1.6), (24, 16, 32))
CAMERA = Camera.look_at((3, -4, 1.1), (0, 0, 0.8), fov_y_degrees=27, size=(40, 56))


@pytest.mark.parametrize("degrees", [-30.0, 0.0, 45.0, 90.0, 135.0])
def test_a_camera_is_where_it_is_turned_to(degrees) -> None:
    """Turned cameras know their angle, and so does a camera in orbit about the same axis."""
    turntable = Turntable.before(CAMERA, DOMAIN)
    assert turntable.degrees(turntable.camera(degrees)) == pytest.approx(degrees)
    assert turntable.degrees(orbit(CAMERA, DOMAIN, degrees)) == pytest.approx(degrees)


@pytest.mark.parametrize("degrees", range(0, 180, 15))
def test_the_domain_fits_into_every_picture_at_a_pixel_a_voxel(degrees) -> None:
    """Whatever the angle."""
    turntable = Turntable.before(CAMERA, DOMAIN)
    camera = turntable.camera(degrees)
    pixels, _ = project(camera, DOMAIN.corners())
    assert (pixels > -1e-6).all()
    assert (pixels < np.array(camera.size) + 1e-6).all()
    assert (camera.size[1], camera.size[0]) == turntable.shape == (32, 29)
    assert camera.fx * DOMAIN.voxel_size == pytest.approx(1)


def test_the_screen_shows_what_stands_on_it_where_it_stands() -> None:
    """A point of the screen in the camera's picture comes back to the pixel of the turntable's own front camera."""
    turntable = Turntable.before(CAMERA, DOMAIN)
    point = np.array(DOMAIN.centre) + 0.25 * turntable.lateral + 0.35 * turntable.height
    picture = np.zeros(CAMERA.size[::-1], np.float32)
    (x, y), _ = project(CAMERA, point)
    picture[int(y), int(x)] = 1
    screen = turntable.screen(picture, CAMERA)
    (column, row), _ = project(turntable.camera(0), point)
    found = np.array(np.unravel_index(screen.argmax(), screen.shape))
    np.testing.assert_allclose(found + 0.5, (row, column), atol=1.1)


def test_nothing_is_seen_behind_the_camera() -> None:
    """A screen that reaches behind a camera inside the domain shows zero there."""
    inside = Camera.look_at((0, 0.1, 0.8), (0, 1, 0.8), fov_y_degrees=60, size=(20, 20))
    assert not Turntable.before(inside, DOMAIN).screen(np.ones((20, 20), np.float32), inside).any()
