"""The turntable: its cameras see the domain turned, and its plane shows a camera's picture."""

import numpy as np
import pytest

from smokelift.density.turntable import Turntable, UprightSmoke
from smokelift.scene import Camera, Domain, orbit
from smokelift.scene.camera import project_points

DOMAIN = Domain((-0.6, -0.4, 0.0), (0.6, 0.4, 1.6), (24, 16, 32))
CAMERA = Camera.look_at((3, -4, 1.1), (0, 0, 0.8), fov_y_degrees=27, size=(40, 56))


@pytest.mark.parametrize("degrees", [-30.0, 0.0, 45.0, 90.0, 135.0])
def test_a_camera_is_where_it_is_turned_to(degrees) -> None:
    turntable = Turntable.facing(CAMERA, DOMAIN)
    assert turntable.degrees(turntable.camera(degrees)) == pytest.approx(degrees)
    assert turntable.degrees(orbit(CAMERA, DOMAIN, degrees)) == pytest.approx(degrees)


@pytest.mark.parametrize("degrees", range(0, 180, 15))
def test_the_domain_fits_into_every_picture_at_a_pixel_a_voxel(degrees) -> None:
    turntable = Turntable.facing(CAMERA, DOMAIN)
    camera = turntable.camera(degrees)
    pixels, _ = project_points(camera, DOMAIN.corners())
    assert (pixels > -1e-6).all()
    assert (pixels < np.array(camera.size) + 1e-6).all()
    assert camera.size == turntable.shape == (29, 32)
    assert camera.fx * DOMAIN.voxel_size == pytest.approx(1)


def test_the_screen_shows_what_stands_on_it_where_it_stands() -> None:
    """A point of the plane in the camera's picture comes back to the pixel of the turntable's own front camera."""
    turntable = Turntable.facing(CAMERA, DOMAIN)
    point = np.array(DOMAIN.centre) + 0.25 * turntable.lateral + 0.35 * turntable.height
    picture = np.zeros(CAMERA.size[::-1], np.float32)
    (x, y), _ = project_points(CAMERA, point)
    picture[int(y), int(x)] = 1
    plane = turntable.on_plane(picture, CAMERA)
    (column, row), _ = project_points(turntable.camera(0), point)
    found = np.array(np.unravel_index(plane.argmax(), plane.shape))
    np.testing.assert_allclose(found + 0.5, (column, plane.shape[1] - row), atol=1.1)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_volume_comes_back_from_standing_upright(axis) -> None:
    camera = Camera.look_at((3, -4, 1.1), (0, 0, 0.8), up=(0, 0, -1), fov_y_degrees=27, size=(40, 56))
    volume = np.random.default_rng(0).random(DOMAIN.resolution, np.float32)
    for each in (CAMERA, camera):
        turntable = Turntable.facing(each, DOMAIN, axis)
        assert turntable.axis == axis
        assert turntable.upright(volume).shape[2] == DOMAIN.resolution[axis]
        np.testing.assert_array_equal(turntable.lying(turntable.upright(volume)), volume)


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0, 90.0, 137.0])
def test_even_smoke_makes_an_even_picture(degrees) -> None:
    domain = Domain((-1, -1, 0), (1, 1, 0.5), (64, 64, 16))
    turntable = Turntable.facing(CAMERA, domain)
    x, y, _ = domain.offsets(domain.centre)
    volume = np.broadcast_to(np.clip((0.8 - np.hypot(x, y)) / domain.voxel_size + 0.5, 0, 1), domain.resolution)
    picture = UprightSmoke.of(turntable, turntable.upright(np.ascontiguousarray(volume, np.float32))).picture(degrees)
    side = (np.arange(len(picture)) + 0.5 - len(picture) / 2) * domain.voxel_size
    inside = np.abs(side) < 0.7
    chords = 2 * np.sqrt(0.64 - side[inside] ** 2) / domain.voxel_size
    np.testing.assert_allclose(picture[inside, 8], chords, rtol=0.01)
    assert picture.sum() == pytest.approx(volume.sum(), rel=1e-5)


def test_a_projection_and_its_scale_are_adjoint() -> None:
    """Small exponents change a sum as the picture's product with them says, also of a part of the domain."""
    turntable = Turntable.facing(CAMERA, DOMAIN)
    random = np.random.default_rng(1)
    whole = turntable.upright(random.random(DOMAIN.resolution, np.float32))
    part = np.ascontiguousarray(whole[5:20, 3:12])
    step = random.random(turntable.shape, np.float32) * np.float32(1e-3)
    scaled, picture = part.copy(), UprightSmoke.of(turntable, part, (5, 3)).picture(33.0)
    UprightSmoke.of(turntable, scaled, (5, 3)).scale(step, 33.0)
    changed = float((scaled - part).sum(dtype=np.float64))
    assert changed == pytest.approx(float((picture * step).sum()), rel=2e-3)
    whole[:5], whole[20:], whole[:, :3], whole[:, 12:] = 0, 0, 0, 0
    np.testing.assert_allclose(picture, UprightSmoke.of(turntable, whole).picture(33.0), atol=1e-5)


def test_only_columns_that_hold_something_are_worked_on() -> None:
    """Where they are said to, between their first and last voxel that is not zero; the result is the same."""
    volume = np.zeros((5, 4, 9), np.float32)
    volume[1, 2, 3:6] = 1
    volume[1, 2, 4] = 0
    volume[4, 0, 8] = 2
    turntable = Turntable.facing(CAMERA, Domain((0, 0, 0), (5, 4, 9), (5, 4, 9)))
    smoke = UprightSmoke.of(turntable, volume)
    spans = smoke.spans
    assert {tuple(map(int, at)): tuple(spans[at]) for at in np.ndindex(5, 4) if np.diff(spans[at])[0]} == {
        (1, 2): (3, 6),
        (4, 0): (8, 9),
    }
    everywhere = np.broadcast_to(np.array([0, 9], np.int32), (5, 4, 2))
    pictures = [each.picture(33.0) for each in (smoke, smoke._replace(spans=everywhere))]
    np.testing.assert_array_equal(*pictures)
    assert pictures[0].sum() == pytest.approx(4)
