"""The benchmark's built-in scene: its formula, and that its densities and its motion belong together."""

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.velocity.flow import Flow, built_in_pair

SHAPE = (32, 32, 48)


@pytest.fixture(scope="module")
def pair():
    return built_in_pair(SHAPE, 0)


def points(count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-0.25, 0.25, (3, count)).astype(np.float32)


def test_the_velocity_has_no_divergence():
    velocity, x, h = Flow.random(np.random.default_rng(0), 96).velocity, points(500), np.float32(2e-3)
    axes = np.eye(3, dtype=np.float32)[:, :, None]
    gradient = np.stack([(velocity(x + h * axis) - velocity(x - h * axis)) / (2 * h) for axis in axes])
    divergence = np.trace(gradient)
    assert np.sqrt(np.mean(divergence**2)) < 2e-3 * np.sqrt(np.mean(np.sum(gradient**2, (0, 1))))


def test_the_motion_carries_the_one_density_into_the_other(pair):
    origin = np.indices(SHAPE) - np.moveaxis(pair.motion, -1, 0)
    carried = ndimage.map_coordinates(pair.before, origin, order=3)
    left, change = (np.linalg.norm((a - pair.after)[pair.counted]) for a in (carried, pair.before))
    assert left < 0.1 * change
