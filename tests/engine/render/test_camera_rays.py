"""The rays of a camera's pixels: where their samples lie."""

import numpy as np
import pytest

from smokelift import Camera, Domain
from smokelift.render.camera_rays import LATERAL, Rays, camera_rays
from smokelift.scene.projection import project_points

DOMAIN = Domain((-0.5, -0.5, 0), (0.5, 0.5, 1.5), (10, 10, 15))
BEFORE = Camera.look_at((0.3, -4, 0.9), (0, 0, 0.7), fov_y_degrees=40, size=(24, 36))
ABOVE = Camera.look_at((0.2, -0.5, 5), (0, 0, 0.7), fov_y_degrees=40, size=(24, 36))
BESIDE = Camera.look_at((-0.7, 0.1, 0.7), (0, 0, 0.6), fov_y_degrees=70, size=(24, 36))
FAR = Camera("orthographic", BEFORE.matrix, (24, 36), 20.0, 20.0, 12.0, 18.0)


def samples(rays: Rays, row: int, column: int) -> np.ndarray:
    """Places (n, 3) of a ray's samples, in voxels of the grid."""
    axis, _, first, last = rays.planes[row, column]
    start_b, slope_b, start_c, slope_c = rays.lines[row, column]
    places = np.zeros((max(last - first + 1, 0), 3))
    planes = np.arange(first, last + 1)
    places[:, axis] = planes
    for other, start, slope in zip(LATERAL[axis], (start_b, start_c), (slope_b, slope_c), strict=True):
        places[:, other] = start + slope * planes
    return places


@pytest.mark.parametrize("camera", [BEFORE, ABOVE, BESIDE, FAR])
def test_samples_are_seen_at_their_pixel_and_lie_in_the_grid(camera: Camera) -> None:
    rays, h = camera_rays(camera, DOMAIN), DOMAIN.voxel_size
    hits = 0
    for row in range(0, 36, 5):
        for column in range(0, 24, 5):
            places = samples(rays, row, column)
            assert ((places > -1) & (places < DOMAIN.resolution)).all()
            world = np.array(DOMAIN.min) + (places + 0.5) * h
            pixels, depth = project_points(camera, world)
            np.testing.assert_allclose(pixels, np.broadcast_to((column + 0.5, row + 0.5), pixels.shape), atol=1e-3)
            assert (depth > 0).all()
            steps = np.linalg.norm(np.diff(world, axis=0), axis=1)
            np.testing.assert_allclose(steps, rays.length[row, column], rtol=1e-4)
            hits += len(places) > 0
    assert hits > 5
    assert set(rays.axes) <= {0, 1, 2}


def test_rays_beside_the_grid_have_no_samples() -> None:
    away = Camera.look_at((0.3, -4, 0.9), (0, -8, 0.7), fov_y_degrees=40, size=(24, 36))
    rays = camera_rays(away, DOMAIN)
    assert (rays.planes[..., 2] > rays.planes[..., 3]).all()
    assert rays.axes == ()
