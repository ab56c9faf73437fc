"""The benchmark's built-in scene: its formula, and that its densities and its motion belong together."""

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.velocity import flow
from benchmarks.velocity.flow import Flow, built_in_pair
from smokelift.evaluation.metrics import volume_error

SHAPE = (32, 32, 48)


@pytest.fixture(scope="module")
def pair():
    return built_in_pair(SHAPE, 0)


def points(count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-0.25, 0.25, (3, count)).astype(np.float32)


def test_the_velocity_has_no_divergence():
    velocity, x, h = Flow.random(np.random.default_rng(0), 96).velocity, points(500), np.float32(2e-3)
    gradient = np.stack(
        [
            (velocity(x + h * axis) - velocity(x - h * axis)) / (2 * h)
            for axis in np.eye(3, dtype=np.float32)[:, :, None]
        ]
    )
    divergence = np.trace(gradient)
    assert np.sqrt(np.mean(divergence**2)) < 2e-3 * np.sqrt(np.mean(np.sum(gradient**2, (0, 1))))


def test_tracing_back_is_exact_to_a_thousandth_of_a_voxel():
    movement, x = Flow.random(np.random.default_rng(0), 288), points(500)
    usual, fine = (movement.back(x, 1.0, steps) for steps in (flow.STEPS_A_FRAME, 16))
    assert np.abs(fine - usual).max() < 1e-3 / 288


def test_the_motion_carries_the_one_density_into_the_other(pair):
    origin = np.indices(SHAPE) - np.moveaxis(pair.motion, -1, 0)
    carried = ndimage.map_coordinates(pair.before, origin, order=3)
    left, change = (np.linalg.norm((a - pair.after)[pair.counted]) for a in (carried, pair.before))
    assert left < 0.1 * change


def test_a_finer_grid_shows_the_motion_in_its_own_voxels(pair):
    coarse = np.linalg.norm(pair.motion, axis=-1).max()
    assert coarse == pytest.approx(SHAPE[2] * flow.FASTEST, rel=0.3)
    fine = np.linalg.norm(built_in_pair((40, 40, 60), 0).motion, axis=-1).max()
    assert fine == pytest.approx(coarse * 60 / 48, rel=0.02)


def test_smoke_is_inside_the_box_and_seeds_differ(pair):
    for axis in range(3):
        for side in (0, -1):
            assert not pair.after.take(side, axis).any()
    assert 0.05 < pair.counted.mean() < 0.3
    radius = np.linalg.norm((np.indices(SHAPE).T - (np.array(SHAPE) - 1) / 2) / 48, axis=-1).T
    assert not pair.after[radius > flow.REACH - 2 / 48].any()  # so nothing is cut off, and the motion known around it
    other = built_in_pair(SHAPE, 1)
    assert volume_error(other.motion, pair.motion, pair.counted) > 0.2
