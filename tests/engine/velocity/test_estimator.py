"""What every estimator has in common."""

from __future__ import annotations

import numpy as np

from smokelift.transport import divergence
from smokelift.velocity import Velocity, estimate_velocity, predict_velocity
from tests.engine.velocity.known_motions import DT, SHAPE, VOXEL, rotation


def test_prediction_is_free_of_divergence_and_keeps_a_uniform_flow():
    zero = Velocity.zero(SHAPE, VOXEL).faces
    uniform = Velocity([np.full_like(a, v) for a, v in zip(zero, (0.3, -0.2, 0.5), strict=True)], VOXEL)
    for a, b in zip(predict_velocity(uniform, DT).faces, uniform.faces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)
    turning = estimate_velocity(*rotation(0.2)[:2], DT, VOXEL)
    predicted = predict_velocity(turning, DT)
    assert np.abs(divergence(predicted)).max() * VOXEL < 1e-4 * np.abs(predicted.centres()).max()
