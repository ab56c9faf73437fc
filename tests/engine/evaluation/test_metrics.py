"""Metrics: known values, limits and refusals."""

import math
from functools import partial

import numpy as np
import pytest

from smokelift import metrics


def test_psnr() -> None:
    black = np.zeros((8, 8, 3))
    assert metrics.psnr(black, black) == math.inf
    assert metrics.psnr(black, black + 0.1) == pytest.approx(20.0)
    assert metrics.psnr(black, black + 25.5, peak=255) == pytest.approx(20.0)
    part = black.copy()
    part[:4] = 1.0
    mask = np.zeros((8, 8), bool)
    mask[:4] = True
    assert metrics.psnr(black, part, mask) == pytest.approx(0.0)
    assert metrics.psnr(black, part, ~mask) == math.inf


def test_ssim_against_its_definition() -> None:
    random = np.random.default_rng(0)
    a, b = random.random((2, 11, 11))
    offsets = np.arange(-5, 6)
    window = np.exp(-(offsets**2) / (2 * 1.5**2))
    weights = np.outer(window, window) / window.sum() ** 2
    mean_a, mean_b = (weights * a).sum(), (weights * b).sum()
    variance_a = (weights * (a - mean_a) ** 2).sum()
    variance_b = (weights * (b - mean_b) ** 2).sum()
    covariance = (weights * (a - mean_a) * (b - mean_b)).sum()
    c1, c2 = 0.01**2, 0.03**2
    expected = (2 * mean_a * mean_b + c1) * (2 * covariance + c2)
    expected /= (mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)
    assert metrics.ssim(a, b) == pytest.approx(expected)
    assert metrics.ssim(255 * a, 255 * b, peak=255) == pytest.approx(expected)


def test_ssim_limits() -> None:
    picture = np.random.default_rng(1).random((30, 40, 3))
    assert metrics.ssim(picture, picture) == pytest.approx(1.0)
    blurred = (picture + np.roll(picture, 1, 0)) / 2
    assert metrics.ssim(picture, np.roll(picture, 7, 1)) < metrics.ssim(picture, blurred) < 1.0


def test_volume_error_and_mass() -> None:
    truth = np.random.default_rng(2).random((4, 5, 6))
    assert metrics.volume_error(truth, truth) == 0.0
    assert metrics.volume_error(np.zeros_like(truth), truth) == 1.0
    assert metrics.volume_error(1.5 * truth, truth) == pytest.approx(0.5)
    assert metrics.volume_error(0 * truth, 0 * truth) == 0.0
    assert metrics.volume_error(truth, 0 * truth) == math.inf
    mask = truth > 0.5
    assert metrics.volume_error(np.where(mask, truth, 9), truth, mask) == 0.0
    assert metrics.mass(np.ones((4, 5, 6), np.float32), 0.5) == 15.0


def test_height_mass_error() -> None:
    truth = np.random.default_rng(4).random((4, 5, 6))
    assert metrics.height_mass_error(np.roll(truth, 2, 0), truth) == pytest.approx(0.0)
    assert metrics.height_mass_error(1.2 * truth, truth) == pytest.approx(0.2)
    one = np.zeros((2, 2, 4))
    one[..., 1] = 1.0
    assert metrics.height_mass_error(np.roll(one, 1, 2), one) == 2.0
    assert metrics.height_mass_error(0 * one, one) == 1.0


def test_velocity_error() -> None:
    random = np.random.default_rng(3)
    truth = random.normal(size=(4, 5, 6, 3))
    assert metrics.velocity_error(truth, truth) == pytest.approx((0.0, 1.0))
    assert metrics.velocity_error(-truth, truth) == pytest.approx((2.0, -1.0))
    assert metrics.velocity_error(0 * truth, truth) == pytest.approx((1.0, 0.0))
    assert metrics.velocity_error(0 * truth, 0 * truth) == (0.0, 1.0)
    turned = np.stack([-truth[..., 1], truth[..., 0], 0 * truth[..., 2]], axis=-1)
    flat = truth * (1, 1, 0)
    assert metrics.velocity_error(turned, flat) == pytest.approx((math.sqrt(2), 0.0), abs=1e-12)
    mask = np.zeros((4, 5, 6), bool)
    mask[0] = True
    other = np.where(mask[..., None], truth, 7.0)
    assert metrics.velocity_error(other, truth, mask) == pytest.approx((0.0, 1.0))


def test_mean_divergence() -> None:
    x, y, z = np.indices((6, 7, 8), float)
    outward = np.stack([x, 2 * y, -5 * z], -1)
    assert metrics.mean_divergence(outward, 0.5) == pytest.approx(4.0)
    assert metrics.mean_divergence(np.stack([-y, x, 0 * z], -1), 0.5) == pytest.approx(0.0)
    mask = np.zeros((6, 7, 8), bool)
    mask[1:3, 1:3, 1:3] = True
    broken = np.where(x[..., None] > 2, 100.0, outward)
    assert metrics.mean_divergence(broken, 0.5, mask) == pytest.approx(4.0)
    assert metrics.mean_divergence(broken, 0.5) > 5.0


def test_a_flow_without_divergence_on_faces_has_none() -> None:
    a, b, c = np.random.default_rng(8).random((3, 9, 9, 9))
    faces = (
        np.diff(c, axis=1)[:, :, :-1] - np.diff(b, axis=2)[:, :-1],
        np.diff(a, axis=2)[:-1] - np.diff(c, axis=0)[:, :, :-1],
        np.diff(b, axis=0)[:, :-1] - np.diff(a, axis=1)[:-1],
    )
    opposite = [(np.delete(f, 0, d) + np.delete(f, -1, d)) / 2 for d, f in enumerate(faces)]
    assert metrics.mean_divergence(np.stack(opposite, -1), 1.0) < 1e-14
    assert metrics.mean_divergence(np.stack([opposite[0], 0 * a[1:, 1:, 1:], opposite[2]], -1), 1.0) > 0.1


def test_warp_error() -> None:
    before = np.zeros((8, 8, 8))
    before[2:5, 2:5, 2:5] = np.random.default_rng(5).random((3, 3, 3))
    after = np.roll(before, 2, 0)
    way = np.zeros((8, 8, 8, 3))
    assert metrics.warp_error(before, after, way) > 1.0
    way[..., 0] = 2.0
    assert metrics.warp_error(before, after, way) == pytest.approx(0.0)
    assert metrics.warp_error(before, after, -way) > 1.0


def test_flicker() -> None:
    steady = np.arange(6.0)[:, None] + np.ones(4)
    assert metrics.flicker(steady) == pytest.approx(0.0)
    assert metrics.flicker(1 + 0.1 * np.array([1, -1, 1, -1])) == pytest.approx(0.4, rel=0.01)


ONES, SPOILT = np.ones((12, 12, 3)), np.ones((12, 12, 3))
SPOILT[0, 0, 0] = np.nan
PAIRS = ((ONES, SPOILT), (SPOILT, ONES), (ONES, ONES[1:]), (ONES[:0], ONES[:0]))
NOTHING, VOLUME, FLOW = np.zeros((12, 12), bool), np.ones((6, 7, 8)), np.ones((6, 7, 8, 3))
MASKED = (metrics.psnr, metrics.volume_error, metrics.velocity_error)


@pytest.mark.parametrize(
    "call",
    [
        *(partial(function, *pair) for function in (*MASKED, metrics.ssim) for pair in PAIRS),
        *(partial(function, ONES, ONES, mask) for function in MASKED for mask in (NOTHING, ~NOTHING[1:])),
        partial(metrics.volume_error, VOLUME, VOLUME, VOLUME == 0),
        partial(metrics.mean_divergence, FLOW, 0.5, np.indices((6, 7, 8))[0] == 0),
        *(partial(function, ONES, ONES, peak=0) for function in (metrics.psnr, metrics.ssim)),
        partial(metrics.ssim, ONES[:10], ONES[:10]),
        partial(metrics.warp_error, VOLUME, VOLUME, FLOW[..., :2]),
        partial(metrics.flicker, ONES[:2]),
        partial(metrics.mass, SPOILT, 1.0),
    ],
)
def test_what_cannot_be_measured_is_refused(call) -> None:
    with pytest.raises(ValueError):
        call()
