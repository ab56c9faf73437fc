"""The profile of smoke in depth, as compiled for millions of voxels."""

from typing import NamedTuple

import numpy as np
import pytest

from smokelift.density.hull import project_voxels
from smokelift.density.profile import DepthProfile, inflated
from smokelift.density.upright_plane import SmokeAxis
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import project_points

DOMAIN = Domain((-1, -1, 0), (1, 1, 3), (32, 32, 48))
BOX = Domain((-1.5, -1.5, 0), (1.5, 1.5, 3), (48, 48, 48))
HEIGHTS = np.linspace(-1.2, 1.2, 20)
LEVEL = Camera.look_at((0, -6, 1.5), (0, 0, 1.5), fov_y_degrees=35, size=(60, 80))
DEPTHS = (np.arange(32) + 0.5) / 16 - 1
"""Of the voxels of `DOMAIN`, m."""


class Profile(NamedTuple):
    """A profile, and what it says at every voxel."""

    profile: DepthProfile
    shape: np.ndarray
    density: np.ndarray

    @staticmethod
    def of(amount: np.ndarray, camera: Camera, axis: SmokeAxis, domain: Domain = DOMAIN) -> "Profile":
        everywhere = np.ones(domain.resolution, np.bool_)
        places, profile = project_voxels(camera, domain).places(everywhere), DepthProfile(amount, camera, domain, axis)
        values = (each(places, everywhere).reshape(domain.resolution) for each in (profile.shape, profile.at))
        return Profile(profile, *values)


def pillar(camera: Camera, first: int, last: int) -> np.ndarray:
    """A picture that shows smoke in some columns."""
    amount = np.zeros(camera.size[::-1], np.float32)
    amount[:, first:last] = 1
    return amount


def axis_of(columns: int, random: np.random.Generator) -> SmokeAxis:
    if columns == 1:
        return SmokeAxis.by_height(HEIGHTS, random.uniform(-0.2, 0.2, 20))
    tables = random.uniform(0, 0.2, (3, 20, columns)) + np.array([-0.1, 0, 0.1])[:, None, None]
    return SmokeAxis(HEIGHTS, np.linspace(-0.8, 0.8, columns), *tables)


@pytest.mark.parametrize("position", [(0.3, -6, 1.2), (0, -3, 6)])
@pytest.mark.parametrize("columns", [1, 9])
def test_smoke_is_spread_about_its_axis(position, columns) -> None:
    """A ray through the middle of the box meets 1 at the axis, less on both sides of it, and in all about one."""
    camera = Camera.look_at(position, (0, 0, 1.5), fov_y_degrees=35, size=(60, 80))
    axis = axis_of(columns, np.random.default_rng(0))
    _, shape, density = Profile.of(pillar(camera, 20, 40), camera, axis)
    assert shape.max() == pytest.approx(1, abs=1e-3)
    if position[2] < 2:  # level rays go along y
        middle = shape[16, :, 24]
        peak = np.argmax(middle)
        assert DEPTHS[peak] == pytest.approx(float(axis.at(np.array([0.03]), np.array([0.03]))[0]), abs=0.07)
        assert (np.diff(middle[:peak]) >= 0).all()
        assert (np.diff(middle[peak:]) <= 0).all()
        assert density[16, :, 24].sum() * DOMAIN.voxel_size == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("lean", [-0.4, 0.4])
def test_smoke_stands_where_its_ray_meets_an_axis_that_leans(lean) -> None:
    """A camera from above looks along rays that fall, so each meets the axis at another height than the middle."""
    camera = Camera.look_at((0, -6, 4), (0, 0, 1.5), fov_y_degrees=40, size=(90, 120))
    shape = Profile.of(pillar(camera, 38, 52), camera, SmokeAxis.by_height(HEIGHTS, lean * HEIGHTS)).shape
    levels = np.arange(10, 38)
    found = DEPTHS[np.argmax(shape[16], 0)[levels]]
    np.testing.assert_allclose(found, lean * ((levels + 0.5) / 16 - 1.5), atol=0.04)


@pytest.mark.parametrize("depth", [-0.3, 0.0, 0.3])
def test_smoke_stands_where_its_ray_is_inside_the_domain(depth) -> None:
    """What shows beyond the domain's ends at the axis is nearer to the camera; elsewhere it is at the axis."""
    profile, shape, _ = Profile.of(pillar(LEVEL, 24, 36), LEVEL, SmokeAxis.upright(depth))
    fraction = profile.fraction_inside()[:, 30]
    mean = DEPTHS @ shape[16] / shape[16].sum(0)
    # but where the ray cuts the edge of the domain, along less than the smoke's depth
    assert np.count_nonzero((fraction > 0) & (fraction < 0.6)) <= 4
    np.testing.assert_allclose(mean[3:-3], depth, atol=0.01)
    assert max(mean[0], mean[-1]) < depth - 0.2


def test_no_plate_sticks_out_from_the_base_of_a_column() -> None:
    """The base of a column that stands on the floor is as deep as its stem, but for the voxels on the floor."""
    amount = pillar(LEVEL, 24, 36)
    base, _ = project_points(LEVEL, np.array([0.0, -0.3, 0.0]))
    amount[int(base[1]) :] = 0
    density = Profile.of(amount, LEVEL, SmokeAxis.upright()).density[16]
    row_sums, squares = density.sum(0), DEPTHS**2 @ density
    depths = np.sqrt(squares / np.maximum(row_sums, 1e-9) - (DEPTHS @ density / np.maximum(row_sums, 1e-9)) ** 2)
    assert depths[1:4].max() < 1.1 * depths[24]


def test_columns_behind_one_another_make_it_deeper() -> None:
    depths, nothing = [], np.zeros((1, 1))
    for apart in (0.0, 0.5):
        axis = SmokeAxis(np.zeros(1), np.zeros(1), nothing, np.full((1, 1), apart), nothing)
        row = Profile.of(pillar(LEVEL, 26, 34), LEVEL, axis).density[16, :, 24]
        depths.append(np.sqrt(row @ DEPTHS**2 / row.sum()))
    assert depths[1] > 1.8 * depths[0]


@pytest.mark.parametrize("turn", [0, 30, 45, 90, 120])
def test_smoke_is_as_deep_as_it_is_wide_across_its_own_axis(turn) -> None:
    """A bar of smoke is as deep as it is thick, however it lies in the picture and however long it is."""
    camera = Camera("orthographic", LEVEL.matrix, (96, 96), 32.0, 32.0, 48.0, 48.0)
    rows, columns = np.indices((96, 96)) - 47.5
    along, across = (
        np.cos(np.radians(turn - each)) * columns - np.sin(np.radians(turn - each)) * rows for each in (0, 90)
    )
    depths = []
    for width in (10, 20):
        amount = ((np.abs(along) < 42) & (np.abs(across) < width / 2)).astype(np.float32)
        row = Profile.of(amount, camera, SmokeAxis.upright(), BOX).density[24, :, 24]
        depths.append(np.sqrt(row @ BOX.offsets(BOX.centre)[1].ravel() ** 2 / row.sum()))
    np.testing.assert_allclose(depths, np.array([10, 20]) / 32 / np.sqrt(12), rtol=0.15)


def test_balls_fill_a_silhouette() -> None:
    rows, columns = np.indices((61, 61)) - 30
    distance = np.hypot(rows, columns)
    half = inflated(distance < 20)
    near = distance < 18
    np.testing.assert_allclose(half[near], np.sqrt(np.maximum(20**2 - distance**2, 0))[near], atol=2)
    assert not half[distance >= 20].any()
    bar = np.zeros((61, 61), np.bool_)
    bar[25:36, 4:57] = True
    np.testing.assert_allclose(inflated(bar)[30, 10:50], 6, atol=0.6)
