"""The paper's velocity estimate."""

import dataclasses

import numpy as np
from scipy import ndimage

from smokelift.baselines.velocity import PaperVelocity
from smokelift.velocity import VelocitySettings
from smokelift.velocity.estimator import DensityPair
from tests.engine.velocity.known_motions import DT, SHAPE, VOXEL, error_in_smoke, rotation, translation

PAPER = PaperVelocity()


def test_paper_mode_recovers_small_motion():
    before, after, truth = translation(np.array([0.1, 0.2, 0.3]))
    velocity = PAPER.estimate(DensityPair(before, after, DT, VOXEL))
    assert error_in_smoke(velocity, after, truth) < 0.15
    assert velocity.figures["divergence"] < 1e-5


def test_paper_mode_does_not_know_the_limits_of_the_default():
    """It stops by its own rule: neither the default's few iterations nor measured noise have a part in it."""
    before, after, _ = rotation(0.15)
    noise = np.random.default_rng(2).standard_normal(SHAPE)
    before = np.maximum(before + 0.1 * noise * (before > 0.01), 0)
    found = PAPER.estimate(DensityPair(before, after, DT, VOXEL))
    assert found.figures["iterations"] > VelocitySettings().solver.iterations
    blurred = [ndimage.gaussian_filter(a.astype(np.float32), PAPER.blur) for a in (before, after)]
    alone = dataclasses.replace(PAPER, blur=0.0).estimate(DensityPair(*blurred, DT, VOXEL))
    # either blur rounds in its own way, which an inner solve may answer by one step more
    np.testing.assert_allclose(found.centres(), alone.centres(), atol=1e-3 * np.abs(alone.centres()).max())
