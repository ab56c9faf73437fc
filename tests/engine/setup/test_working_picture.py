"""The working picture: the part of a picture that the domain covers, as fine as the grid."""

import numpy as np
import pytest

from smokelift.scene import Camera, Domain
from smokelift.scene.camera import project_points
from smokelift.setup.working_picture import CameraError, working_picture

DOMAIN = Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (24, 24, 32))
CENTER = np.array([0, 0, 0.8])
PERSPECTIVE = Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=30, size=(160, 224))
ORTHOGRAPHIC = Camera("orthographic", PERSPECTIVE.matrix, (160, 224), 103.0, 103.0, 80.0, 112.0)
TILTED = Camera.look_at((1, -4, 2.0), (0, 0, 0.8), fov_y_degrees=30, size=(160, 224))
both = pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC])


@both
def test_a_working_pixel_is_a_voxel_wide_at_the_center(camera) -> None:
    small = working_picture(camera, DOMAIN).camera
    h = DOMAIN.voxel_size
    origin, _ = project_points(small, CENTER)
    for step in ((h, 0, 0), (0, 0, h)):
        moved, _ = project_points(small, CENTER + np.array(step))
        assert np.linalg.norm(moved - origin) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC, TILTED])
def test_points_fall_to_the_same_place_of_both_pictures(camera) -> None:
    work = working_picture(camera, DOMAIN)
    points = np.random.default_rng(1).uniform(DOMAIN.min, DOMAIN.max, (50, 3))
    full, depth = project_points(camera, points)
    small, small_depth = project_points(work.camera, points)
    shrink = np.array(work.camera.size) / (work.width, work.height)
    np.testing.assert_allclose(small, (full - (work.left, work.top)) * shrink, atol=1e-9)
    np.testing.assert_allclose(small_depth, depth)
    assert (small >= 0).all()
    assert (small <= work.camera.size).all()


@both
def test_the_cut_shows_what_the_small_camera_sees(camera) -> None:
    """A picture whose values are its own coordinates, cut, reads right at the projections of world points."""
    work = working_picture(camera, DOMAIN)
    width, height = camera.size
    y, x = np.mgrid[:height, :width] + 0.5
    cut = work.cut(np.stack([x, y], -1).astype(np.float32))
    columns, rows = work.camera.size
    assert cut.shape == (rows, columns, 2)
    small_y, small_x = np.mgrid[:rows, :columns] + 0.5
    across, down = work.width / columns, work.height / rows
    np.testing.assert_allclose(cut[..., 0], work.left + small_x * across, atol=0.05)
    np.testing.assert_allclose(cut[..., 1], work.top + small_y * down, atol=0.05)


@both
def test_coarse_footage_is_not_enlarged(camera) -> None:
    work = working_picture(camera.resized(20, 28), DOMAIN)
    assert work.camera.size == (work.width, work.height)
    assert work.width <= 20


@both
def test_a_domain_outside_the_view_is_refused(camera) -> None:
    beside = Domain((9.4, -0.6, 0), (10.6, 0.6, 1.6), (24, 24, 32))
    with pytest.raises(CameraError, match="domain"):
        working_picture(camera, beside)
