"""Cameras: what is one, and one made of another."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scene_examples import CENTER, DOMAIN, FRONT, ORTHOGRAPHIC, PERSPECTIVE, TILTED, moving_camera

from smokelift.scene import Camera, SceneError, orbit
from smokelift.scene.camera import project_points

both = pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC], ids=["perspective", "orthographic"])
all_three = pytest.mark.parametrize(
    "camera", [PERSPECTIVE, ORTHOGRAPHIC, TILTED], ids=["perspective", "orthographic", "tilted"]
)


@pytest.mark.parametrize(
    "rows",
    [
        np.diag([2.0, 1.0, 1.0, 1.0]),
        np.diag([-1.0, 1.0, 1.0, 1.0]),
        np.eye(4) + np.eye(4)[::-1],
        np.eye(3),
        np.full((4, 4), np.nan),
    ],
)
def test_only_rigid_matrices_are_cameras(rows) -> None:
    with pytest.raises(SceneError, match="matrix"):
        Camera("perspective", rows, (4, 4), 1.0, 1.0, 2.0, 2.0)  # type: ignore[arg-type]


def test_look_at_turns_the_camera_to_the_target() -> None:
    camera = Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=(256, 384))
    np.testing.assert_allclose(camera.matrix, FRONT, atol=1e-12)
    oblique = np.array(Camera.look_at((1, 2, 3), (-4, 0, 1), fov_y_degrees=30, size=(4, 4)).matrix)
    forward = -oblique[:3, 2]
    np.testing.assert_allclose(forward, np.array([-5, -2, -2]) / math.sqrt(33))
    assert oblique[2, 0] == pytest.approx(0.0)  # the horizon is level
    assert oblique[2, 1] > 0.0


def test_resizing_and_cropping_keep_the_rays() -> None:
    camera = Camera("perspective", FRONT, (256, 384), 700.0, 710.0, 120.0, 200.0)

    def ray(camera: Camera, x: float, y: float) -> tuple[float, float]:
        return (x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy

    small = camera.resized(64, 192)
    assert small.size == (64, 192)
    assert ray(small, 10, 30) == pytest.approx(ray(camera, 40, 60))
    part = camera.cropped(20, 30, 100, 50)
    assert part.size == (100, 50)
    assert ray(part, 5, 6) == pytest.approx(ray(camera, 25, 36))
    assert small.position == camera.position == (0.0, -7.0, 1.5)


def test_a_moving_camera_stands_still_in_every_frame() -> None:
    camera = moving_camera((0, -7, 1.5), (1, -7, 1.5), (2, -7, 1.5))
    for frame in range(3):
        still = camera.at(frame)
        assert not still.moves
        assert still.position == (frame, -7.0, 1.5)
        assert still.at(9) == still
        assert camera.resized(64, 96).at(frame) == still.resized(64, 96)
    assert camera.matrix == camera.matrices[0]
    with pytest.raises(SceneError, match="0 to 2"):
        camera.at(3)
    with pytest.raises(SceneError, match="matrices"):
        replace(camera, matrix=camera.matrices[1])


@all_three
@pytest.mark.parametrize(("yaw", "pitch"), [(33, 0), (0, 25), (-120, -10)])
def test_an_orbit_keeps_distance_and_aim(camera, yaw, pitch) -> None:
    moved = orbit(camera, DOMAIN, yaw, pitch)
    distance = [np.linalg.norm(np.array(c.position) - CENTER) for c in (camera, moved)]
    assert distance[1] == pytest.approx(distance[0])
    for before, after in zip(project_points(camera, CENTER), project_points(moved, CENTER), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-9)
    assert (moved.size, moved.fx, moved.fy, moved.type) == (camera.size, camera.fx, camera.fy, camera.type)


@both
def test_ninety_degrees_look_from_the_right_side(camera) -> None:
    side = orbit(camera, DOMAIN, 90)
    np.testing.assert_allclose(side.position, (4, 0, 0.8), atol=1e-12)
    matrix = np.array(side.matrix)
    np.testing.assert_allclose(-matrix[:3, 2], (-1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(matrix[:3, 1], (0, 0, 1), atol=1e-12)


@all_three
def test_pitch_raises_the_camera(camera) -> None:
    x, y, z = np.array(camera.position) - CENTER
    elevation = np.degrees(np.arctan2(z, np.hypot(x, y)))
    for pitch in (20.0, -20.0):
        x, y, z = np.array(orbit(camera, DOMAIN, 70, pitch).position) - CENTER
        assert np.degrees(np.arctan2(z, np.hypot(x, y))) == pytest.approx(elevation + pitch)
