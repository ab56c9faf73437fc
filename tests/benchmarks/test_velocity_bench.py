"""``python -m benchmarks.velocity``: errors of whole estimates, and its built-in scene."""

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.velocity.__main__ import ESTIMATORS, against_truth
from benchmarks.velocity.flow import Flow, built_in_pair
from benchmarks.velocity.pairs import Pair, pair_of_truth
from smokelift.velocity import CoarseToFine
from tests.benchmarks.ball import truth

SHAPE, FINE = (16, 16, 24), (32, 32, 48)


def test_more_iterations_are_nearer_to_the_truth():
    pairs = [built_in_pair(FINE, seed) for seed in range(2)]
    few, many = (against_truth(pairs, ESTIMATORS[f"{n} iterations"])[0] for n in (2, 20))
    assert many < few < 0.5


def test_smoke_at_rest_has_the_error_of_the_motion_that_it_has_not():
    pair = built_in_pair(SHAPE, 0)
    rest = Pair(pair.before, pair.before, pair.motion, pair.inlet)
    assert against_truth([rest], CoarseToFine())[0] == pytest.approx(1, abs=0.01)


def test_a_baked_pair_has_its_motion_in_voxels_per_frame():
    smoke = built_in_pair(SHAPE, 0).before
    pair = pair_of_truth(truth(np.stack([smoke, np.roll(smoke, 1, axis=2)]), 0.1, speed=0.1 * 24), 0)
    np.testing.assert_allclose(pair.motion[pair.compared].mean(0), (0, 0, 1), atol=1e-3)


@pytest.fixture(scope="module")
def pair():
    return built_in_pair(FINE, 0)


def test_the_velocity_has_no_divergence():
    velocity, h = Flow.random(np.random.default_rng(0), 96).velocity, np.float32(2e-3)
    x = np.random.default_rng(1).uniform(-0.25, 0.25, (3, 500)).astype(np.float32)
    axes = np.eye(3, dtype=np.float32)[:, :, None]
    gradient = np.stack([(velocity(x + h * axis) - velocity(x - h * axis)) / (2 * h) for axis in axes])
    divergence = np.trace(gradient)
    assert np.sqrt(np.mean(divergence**2)) < 2e-3 * np.sqrt(np.mean(np.sum(gradient**2, (0, 1))))


def test_the_motion_carries_the_one_density_into_the_other(pair):
    origin = np.indices(FINE) - np.moveaxis(pair.motion, -1, 0)
    carried = ndimage.map_coordinates(pair.before, origin, order=3)
    left, change = (np.linalg.norm((a - pair.after)[pair.compared]) for a in (carried, pair.before))
    assert left < 0.1 * change
