"""``python -m benchmarks.velocity``: errors of whole estimates, and how they are timed."""

import numpy as np
import pytest

from benchmarks.velocity.__main__ import ESTIMATORS, against_truth
from benchmarks.velocity.flow import built_in_pair
from benchmarks.velocity.pairs import Pair, pair_of_truth
from smokelift.velocity import CoarseToFine
from tests.benchmarks.ball import truth

SHAPE = (16, 16, 24)


def test_more_iterations_are_nearer_to_the_truth():
    pairs = [built_in_pair((32, 32, 48), seed) for seed in range(2)]
    few, many = (against_truth(pairs, ESTIMATORS[f"{n} iterations"])[0] for n in (2, 20))
    assert many < few < 0.5


def test_smoke_at_rest_has_the_error_of_the_motion_that_it_has_not():
    pair = built_in_pair(SHAPE, 0)
    rest = Pair(pair.before, pair.before, pair.motion, pair.inlet)
    assert against_truth([rest], CoarseToFine())[0] == pytest.approx(1, abs=0.01)


def test_a_baked_pair_has_its_motion_in_voxels_a_frame():
    smoke = built_in_pair(SHAPE, 0).before
    pair = pair_of_truth(truth(np.stack([smoke, np.roll(smoke, 1, axis=2)]), 0.1, speed=0.1 * 24), 0)
    np.testing.assert_allclose(pair.motion[pair.counted].mean(0), (0, 0, 1), atol=1e-3)
