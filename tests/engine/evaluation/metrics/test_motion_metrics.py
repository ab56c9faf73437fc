"""Metrics of velocities: known values, limits and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from smokelift.evaluation.metrics import flicker, mean_divergence, velocity_error, warp_error


def test_velocity_error() -> None:
    random = np.random.default_rng(3)
    truth = random.normal(size=(4, 5, 6, 3))
    assert velocity_error(truth, truth) == pytest.approx((0.0, 1.0))
    assert velocity_error(-truth, truth) == pytest.approx((2.0, -1.0))
    assert velocity_error(0 * truth, truth) == pytest.approx((1.0, 0.0))
    assert velocity_error(0 * truth, 0 * truth) == (0.0, 1.0)
    turned = np.stack([-truth[..., 1], truth[..., 0], 0 * truth[..., 2]], axis=-1)
    flat = truth * (1, 1, 0)
    assert velocity_error(turned, flat) == pytest.approx((math.sqrt(2), 0.0), abs=1e-12)
    mask = np.zeros((4, 5, 6), bool)
    mask[0] = True
    other = np.where(mask[..., None], truth, 7.0)
    assert velocity_error(other, truth, mask) == pytest.approx((0.0, 1.0))


def test_mean_divergence() -> None:
    x, y, z = np.indices((6, 7, 8), float)
    outward = np.stack([x, 2 * y, -5 * z], -1)
    assert mean_divergence(outward, 0.5) == pytest.approx(4.0)
    assert mean_divergence(np.stack([-y, x, 0 * z], -1), 0.5) == pytest.approx(0.0)
    mask = np.zeros((6, 7, 8), bool)
    mask[1:3, 1:3, 1:3] = True
    broken = np.where(x[..., None] > 2, 100.0, outward)
    assert mean_divergence(broken, 0.5, mask) == pytest.approx(4.0)
    assert mean_divergence(broken, 0.5) > 5.0
    with pytest.raises(ValueError, match="count"):
        mean_divergence(outward, 0.5, x == 0)


def test_a_flow_without_divergence_on_faces_has_none() -> None:
    """However rough it is: the curl of noise on a staggered grid, at the centres."""
    a, b, c = np.random.default_rng(8).random((3, 9, 9, 9))
    faces = (
        np.diff(c, axis=1)[:, :, :-1] - np.diff(b, axis=2)[:, :-1],
        np.diff(a, axis=2)[:-1] - np.diff(c, axis=0)[:, :, :-1],
        np.diff(b, axis=0)[:, :-1] - np.diff(a, axis=1)[:-1],
    )
    opposite = [(np.delete(f, 0, d) + np.delete(f, -1, d)) / 2 for d, f in enumerate(faces)]
    assert mean_divergence(np.stack(opposite, -1), 1.0) < 1e-14
    assert mean_divergence(np.stack([opposite[0], 0 * a[1:, 1:, 1:], opposite[2]], -1), 1.0) > 0.1


def test_warp_error() -> None:
    before = np.zeros((8, 8, 8))
    before[2:5, 2:5, 2:5] = np.random.default_rng(5).random((3, 3, 3))
    after = np.roll(before, 2, 0)
    way = np.zeros((8, 8, 8, 3))
    assert warp_error(before, after, way) > 1.0
    way[..., 0] = 2.0
    assert warp_error(before, after, way) == pytest.approx(0.0)
    assert warp_error(before, after, -way) > 1.0
    with pytest.raises(ValueError, match="vector for each"):
        warp_error(before, after, way[..., :2])


def test_flicker() -> None:
    steady = np.arange(6.0)[:, None] + np.ones(4)
    assert flicker(steady) == pytest.approx(0.0)
    assert flicker(np.array([1.0, 1.0, 1.0, 1.0]) + 0.1 * np.array([1, -1, 1, -1])) == pytest.approx(0.4, rel=0.01)
    with pytest.raises(ValueError, match="three frames"):
        flicker(steady[:2])
