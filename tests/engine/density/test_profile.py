"""The profile of smoke in depth, as compiled for millions of voxels."""

import numpy as np
import pytest

from smokelift.density.axis import SmokeAxis
from smokelift.density.hull import project_voxels
from smokelift.density.profile import DepthProfile
from smokelift.scene import Camera, Domain

DOMAIN = Domain((-1, -1, 0), (1, 1, 3), (32, 32, 48))
BOX = Domain((-1.5, -1.5, 0), (1.5, 1.5, 3), (48, 48, 48))
HEIGHTS = np.linspace(-1.2, 1.2, 20)


def axis_of(columns: int, random: np.random.Generator) -> SmokeAxis:
    if columns == 1:
        return SmokeAxis.by_height(HEIGHTS, random.uniform(-0.2, 0.2, 20))
    tables = random.uniform(0, 0.2, (3, 20, columns)) + np.array([-0.1, 0, 0.1])[:, None, None]
    return SmokeAxis(HEIGHTS, np.linspace(-0.8, 0.8, columns), *tables)


@pytest.mark.parametrize("position", [(0.3, -6, 1.2), (0, -3, 6)])
@pytest.mark.parametrize("columns", [1, 9])
def test_smoke_is_spread_about_its_axis(position, columns) -> None:
    """A ray through the middle of the box meets 1 at the axis, less on both sides of it, and in all about one."""
    random = np.random.default_rng(0)
    camera = Camera.look_at(position, (0, 0, 1.5), fov_y_degrees=35, size=(60, 80))
    amount = np.ones((80, 60), np.float32)
    amount[:, :20] = amount[:, 40:] = 0
    axis = axis_of(columns, random)
    profile = DepthProfile(amount, camera, DOMAIN, axis)
    everywhere = np.ones(DOMAIN.resolution, np.bool_)
    places = project_voxels(camera, DOMAIN).places(everywhere)
    shape = profile.shape(places, everywhere).reshape(DOMAIN.resolution)
    density = profile.at(places, everywhere).reshape(DOMAIN.resolution)
    assert shape.max() == pytest.approx(1, abs=1e-3)
    if position[2] < 2:  # level rays go along y
        middle = shape[16, :, 24]
        depth = -0.96875 + 0.0625 * np.argmax(middle)
        assert depth == pytest.approx(float(axis.at(np.array([0.03]), np.array([0.03]))[0]), abs=0.07)
        assert (np.diff(middle[: np.argmax(middle)]) >= 0).all()
        assert (np.diff(middle[np.argmax(middle) :]) <= 0).all()
        assert density[16, :, 24].sum() * DOMAIN.voxel_size == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("lean", [-0.4, 0.4])
def test_smoke_stands_where_its_ray_meets_an_axis_that_leans(lean: float) -> None:
    """A camera from above looks along rays that fall, so each meets the axis at another height than the middle."""
    camera = Camera.look_at((0, -6, 4), (0, 0, 1.5), fov_y_degrees=40, size=(90, 120))
    amount = np.zeros((120, 90), np.float32)
    amount[:, 38:52] = 1
    axis = SmokeAxis.by_height(HEIGHTS, lean * HEIGHTS)
    everywhere = np.ones(DOMAIN.resolution, np.bool_)
    places = project_voxels(camera, DOMAIN).places(everywhere)
    shape = DepthProfile(amount, camera, DOMAIN, axis).shape(places, everywhere).reshape(DOMAIN.resolution)
    levels = np.arange(10, 38)
    found = (np.argmax(shape[16], 0)[levels] + 0.5) / 16 - 1
    np.testing.assert_allclose(found, lean * ((levels + 0.5) / 16 - 1.5), atol=0.04)


@pytest.mark.parametrize("depth", [-0.3, 0.0, 0.3])
def test_smoke_stands_where_its_ray_is_inside_the_domain(depth: float) -> None:
    """What shows beyond the domain's ends at the axis is nearer to the camera; elsewhere it is at the axis."""
    camera = Camera.look_at((0, -6, 1.5), (0, 0, 1.5), fov_y_degrees=35, size=(60, 80))
    amount = np.zeros((80, 60), np.float32)
    amount[:, 24:36] = 1
    everywhere = np.ones(DOMAIN.resolution, np.bool_)
    places = project_voxels(camera, DOMAIN).places(everywhere)
    profile = DepthProfile(amount, camera, DOMAIN, SmokeAxis.upright(depth))
    fraction, shape = profile.fraction_inside()[:, 30], profile.shape(places, everywhere).reshape(DOMAIN.resolution)
    behind = (np.arange(32) + 0.5) / 16 - 1
    mean = behind @ shape[16] / shape[16].sum(0)
    # but where the ray cuts the edge of the domain, along less than the smoke's depth
    assert np.count_nonzero((fraction > 0) & (fraction < 0.6)) <= 4
    np.testing.assert_allclose(mean[3:-3], depth, atol=0.01)
    assert max(mean[0], mean[-1]) < depth - 0.2


@pytest.mark.parametrize("turn", [0, 30, 45, 90, 120])
def test_smoke_is_as_deep_as_it_is_wide_across_its_own_axis(turn: float) -> None:
    """A bar of smoke is as deep as it is thick, however it lies in the picture and however long it is."""
    matrix = Camera.look_at((0, -6, 1.5), (0, 0, 1.5), fov_y_degrees=35, size=(96, 96)).matrix
    camera = Camera("orthographic", matrix, (96, 96), 32.0, 32.0, 48.0, 48.0)
    rows, columns = np.indices((96, 96)) - 47.5
    along, across = (
        np.cos(np.radians(turn - each)) * columns - np.sin(np.radians(turn - each)) * rows for each in (0, 90)
    )
    depths = []
    for width in (10, 20):
        amount = ((np.abs(along) < 42) & (np.abs(across) < width / 2)).astype(np.float32)
        everywhere = np.ones(BOX.resolution, np.bool_)
        profile = DepthProfile(amount, camera, BOX, SmokeAxis.upright())
        row = profile.at(project_voxels(camera, BOX).places(everywhere), everywhere).reshape(BOX.resolution)[24, :, 24]
        depth = BOX.offsets(BOX.centre)[1].ravel()
        depths.append(np.sqrt(row @ depth**2 / row.sum()))
    np.testing.assert_allclose(depths, np.array([10, 20]) / 32 / np.sqrt(12), rtol=0.15)
