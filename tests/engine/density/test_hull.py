"""Where voxels lie in pictures, computed for those that are asked for, against NumPy's and SciPy's own."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.density.hull import project_voxels
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import project_points

DOMAIN = Domain((-1.0, -1.0, 0.0), (1.0, 1.0, 3.0), (10, 10, 15))
CENTERS = np.stack(np.broadcast_arrays(*DOMAIN.offsets((0, 0, 0))), -1)
SIZE = (21, 17)

CAMERAS = {
    "in front": Camera.look_at((0.3, -6.0, 1.0), (0.0, 0.0, 1.5), fov_y_degrees=25, size=SIZE),
    "close, some voxels behind it": Camera.look_at((0.0, -1.2, 1.0), (0.4, 0.0, 1.0), fov_y_degrees=70, size=SIZE),
    "far away": Camera("orthographic", ((1, 0, 0, 0), (0, 0, -1, -9), (0, 1, 0, 1), (0, 0, 0, 1)), SIZE, 7, 7, 10, 8),
}


@pytest.fixture(params=CAMERAS.values(), ids=CAMERAS.keys())
def camera(request):
    return request.param


def _expected(camera):
    """Rows, columns and visibility of all voxels by NumPy alone."""
    pixels, depth = project_points(camera, CENTERS)
    columns, rows = pixels[..., 0] - 0.5, pixels[..., 1] - 0.5
    width, height = SIZE
    inside = (columns > -0.5) & (columns < width - 0.5) & (rows > -0.5) & (rows < height - 0.5)
    return rows, columns, inside & (depth > 0)


def test_places_are_those_of_the_projection(camera):
    rows, columns, visible = _expected(camera)
    some = np.random.default_rng(0).random(DOMAIN.resolution) < 0.3
    places = project_voxels(camera, DOMAIN).places(some)
    np.testing.assert_allclose(places.rows, rows[some], rtol=1e-6)
    np.testing.assert_allclose(places.columns, columns[some], rtol=1e-6)
    np.testing.assert_array_equal(places.visible, visible[some])
    assert places.visible.any()


def test_a_voxel_is_shown_where_its_nearest_pixel_is_marked(camera):
    rows, columns, visible = _expected(camera)
    marked = np.random.default_rng(1).random(SIZE[::-1]) < 0.5
    at = [np.clip(np.rint(places), 0, most - 1).astype(int) for places, most in ((rows, 17), (columns, 21))]
    projection = project_voxels(camera, DOMAIN)
    np.testing.assert_array_equal(projection.shown(marked), marked[at[0], at[1]] & visible)
    np.testing.assert_array_equal(projection.visible, visible)


def test_the_footprint_is_that_of_the_nearest_voxel():
    camera = CAMERAS["in front"]
    _, depth = project_points(camera, CENTERS)
    assert project_voxels(camera, DOMAIN).footprint == pytest.approx(camera.fy * 0.2 * np.sqrt(3) / depth.min())


def test_pictures_are_read_as_scipy_reads_them(camera):
    everywhere = np.ones(DOMAIN.resolution, np.bool_)
    picture = np.random.default_rng(2).normal(size=SIZE[::-1]).astype(np.float32)
    places = project_voxels(camera, DOMAIN).places(everywhere)
    expected = ndimage.map_coordinates(picture, (places.rows, places.columns), order=1, mode="nearest")
    np.testing.assert_array_equal(places.read(picture), expected)
