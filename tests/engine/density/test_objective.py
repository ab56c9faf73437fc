"""What noise leaves of the objective; a moment on a grid half as fine, and what was found there on the finer one."""

from collections.abc import Iterator

import numpy as np
import pytest
from scipy import ndimage

import smokelift._core as _core
from smokelift import Clip, Settings, Shot, prepare_shot
from smokelift.density import DetailedDepth, GradientFit, Observation, RoundDepth, ViewSet
from smokelift.density import objective as module
from smokelift.density.objective import Level, any_of_two, camera_terms, noise_floor, with_neighbors
from smokelift.extraction.plate import Plate
from smokelift.footage.images import linear_to_srgb
from smokelift.footage.noise import Noise, linear_per_srgb
from smokelift.render import scene_optics
from smokelift.scene import Camera, Domain, Scene, completed

NOISE = 0.03
"""Standard deviation of a pixel, sRGB values."""


def test_noise_that_has_faded_with_the_picture_is_not_expected() -> None:
    """What shows no smoke is the background itself, without noise: a fit that expects it stops too early."""
    camera = Camera.look_at((0, -4, 0), (0, 0, 0), fov_y_degrees=30, size=(64, 64))
    scene = completed(Scene(camera=camera, domain=Domain((-1, -1, -1), (1, 1, 1), (12, 12, 12))))
    rows, columns = np.mgrid[:64, :64]
    opacity = 0.8 * np.clip(1.5 - np.hypot(rows - 32, columns - 32) / 8, 0, 1)[..., None]
    truth = (0.2 * (1 - opacity) + 0.6 * opacity).astype(np.float32).repeat(3, -1)
    noise = np.random.default_rng(0).normal(0, NOISE, truth.shape) * linear_per_srgb(linear_to_srgb(truth))
    one = np.ones((64, 64), np.float32)
    plate = Plate(
        0.2 * one[..., None].repeat(3, -1), one, Noise(np.full(3, NOISE, np.float32), np.full(3, 1e-3, np.float32))
    )
    views = ViewSet.of([Observation(camera, (truth + noise).astype(np.float32), plate)], scene_optics(scene))
    (term,) = camera_terms(views, [one])
    assert noise_floor([term]) == pytest.approx(term.loss(truth - views.views[0].image), rel=0.2)


SHAPE = (24, 24, 32)
ODD = (5, 4, 7)


@pytest.fixture(scope="module")
def shot(plume, tmp_path_factory) -> Iterator[Shot]:
    """A column with stripes along its height, which ends above the floor and below the ceiling."""
    x, y, z = np.meshgrid(*(np.arange(n) + 0.5 - n / 2 for n in SHAPE), indexing="ij")
    column = np.exp(-((np.hypot(x, y) / 6) ** 4) - (z / 8) ** 4)
    moments = [(0.2 * column * (1.5 + np.sin(z + n))).astype(np.float32) for n in range(3)]
    scene = plume.write(tmp_path_factory.mktemp("striped"), moments)
    with Clip.open(scene.clip) as clip:
        yield prepare_shot(clip, scene, Settings.preset("draft"))


@pytest.fixture
def large(monkeypatch) -> None:
    """Let every grid of this size count as large, and one half as fine as small."""
    monkeypatch.setattr(module, "MIN_COARSENED_VOXELS", 2500)


def level(shot: Shot) -> Level:
    estimate = RoundDepth().of_clip(shot).estimate(ViewSet.of(shot.observe(1), shot.optics, 1))
    return Level(estimate.views, estimate.inside_fraction)


def test_a_coarser_grid_covers_the_smoke_once(shot, large) -> None:
    fine = level(shot)
    coarser = fine.coarser
    assert coarser.coarser is None
    assert coarser.views.hull.shape == (12, 12, 16)
    assert not (fine.views.hull & ~coarser.views.hull.repeat(2, 0).repeat(2, 1).repeat(2, 2)).any()
    assert coarser.views.optics.domain.voxel_size == pytest.approx(2 * fine.views.optics.domain.voxel_size)
    picture, small = fine.views.views[0].image, coarser.views.views[0].image
    assert small.shape[0] == round(picture.shape[0] / 2)
    assert small.mean() == pytest.approx(picture.mean(), rel=0.01)


def test_what_stays_there_stays_here(shot, large) -> None:
    fine = level(shot)
    density = np.zeros(SHAPE, np.float32)
    density[fine.views.hull] = np.random.default_rng(0).random(np.count_nonzero(fine.views.hull), np.float32)
    np.testing.assert_allclose(fine.changed_on_coarser(density, lambda means: means), density, rtol=1e-5)
    np.testing.assert_allclose(fine.changed_on_coarser(density, lambda means: 3 * means), 3 * density, rtol=1e-5)
    means = fine.coarse_means(density)
    assert 8 * means.sum(dtype=np.float64) == pytest.approx(density.sum(dtype=np.float64), rel=1e-5)


@pytest.mark.parametrize("deviation", [3.0, 4.0, 7.0])
def test_a_wide_blur_on_coarser_grids_is_about_the_same(shot, deviation) -> None:
    """Beside that of another density: at the hull's edge both fade."""
    fine = level(shot)
    hull = fine.views.hull
    density = np.where(hull, np.float32(1) + np.indices(SHAPE, np.float32)[2] % 3, np.float32(0))
    wanted, seen = (
        blur(density) / blur(hull.astype(np.float32))
        for blur in (
            lambda values: ndimage.gaussian_filter(values, deviation, mode="constant")[hull],
            lambda values: fine.blurred(values, deviation),
        )
    )
    np.testing.assert_allclose(seen, wanted, rtol=0.03)


def test_the_front_is_met_as_without_it(shot, monkeypatch) -> None:
    def fitted() -> tuple[np.ndarray, float]:
        views = ViewSet.of(shot.observe(1), shot.optics, 1)
        found = GradientFit().fit(views, DetailedDepth(RoundDepth()).of_clip(shot).estimate(views), None)
        return found.density, found.figures["psnr"]

    plain, psnr = fitted()
    monkeypatch.setattr(module, "MIN_COARSENED_VOXELS", 2500)
    density, coarse_to_fine = fitted()
    again, _ = fitted()
    np.testing.assert_array_equal(density, again)
    assert min(psnr, coarse_to_fine) > 50
    assert density.sum() == pytest.approx(plain.sum(), rel=0.1)


def test_a_mark_is_kept_on_a_coarser_grid() -> None:
    voxels = np.zeros(ODD, np.bool_)
    voxels[4, 1, 6] = voxels[1, 2, 3] = True
    np.testing.assert_array_equal(np.argwhere(any_of_two(voxels)), [[0, 1, 1], [2, 0, 3]])


def test_means_keep_the_sum_and_prolonged_values_their_mean() -> None:
    values = np.random.default_rng(0).random(ODD, np.float32)
    means = _core.means_of_two(values)
    assert np.isclose(8 * means.sum(dtype=np.float64), values.sum(dtype=np.float64))
    everywhere = np.ones(ODD, np.bool_)
    np.testing.assert_allclose(_core.prolong_values(np.full((3, 2, 4), 2, np.float32), everywhere), 2)
    ramp = np.ascontiguousarray(np.broadcast_to(np.arange(4, dtype=np.float32), (3, 2, 4)))
    fine = _core.prolong_values(ramp, everywhere).reshape(ODD)
    np.testing.assert_allclose(fine[2, 1], [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75])


def test_values_scale_as_coarse_ones_do_where_they_are_marked_alone() -> None:
    values, marks = np.random.default_rng(0).random((2, *ODD), np.float32)
    voxels, result = marks > 0.5, np.zeros(ODD, np.float32)
    before = _core.means_of_two(values)
    x = np.arange(3, dtype=np.float32).reshape(-1, 1, 1)
    _core.scale_alike(values[1:], voxels[1:], before[1:], 3 * before[1:], 1e-30, result[1:])
    np.testing.assert_allclose(result[1:], np.where(voxels, 3 * values, 0)[1:], rtol=1e-6)
    assert not result[0].any()
    _core.scale_alike(values, voxels, np.ones_like(before), np.ones_like(before) * x, 1e-30, result)
    np.testing.assert_allclose(result[2], np.where(voxels, values, 0)[2] * 0.75, rtol=1e-6)


def test_neighbors_are_those_of_a_dilation() -> None:
    voxels = np.random.default_rng(0).random((6, 7, 9)) > 0.95
    np.testing.assert_array_equal(with_neighbors(voxels), ndimage.binary_dilation(voxels))
