"""What every estimator has in common."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.transport import divergence, part_of
from smokelift.velocity import estimate_velocity, predict_velocity
from smokelift.velocity.estimator import refine, refine_in_box
from tests.engine.transport.random_fields import random_velocity
from tests.engine.velocity.known_motions import DT, VOXEL, rotation, uniform


def test_prediction_is_free_of_divergence_and_keeps_a_uniform_flow():
    steady = uniform((0.3, -0.2, 0.5))
    for a, b in zip(predict_velocity(steady, DT).faces, steady.faces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)
    turning = estimate_velocity(*rotation(0.2)[:2], DT, VOXEL)
    predicted = predict_velocity(turning, DT)
    assert np.abs(divergence(predicted)).max() * VOXEL < 1e-4 * np.abs(predicted.centres()).max()


@pytest.mark.parametrize("shape", [(40, 36, 44), (41, 35, 43)])
@pytest.mark.parametrize(
    "box", [(slice(13, 20), slice(0, 9), slice(30, 31)), (slice(0, 5), slice(11, 25), slice(14, 33))]
)
def test_part_of_a_finer_velocity_is_what_the_whole_has_there(shape, box):
    """Computed around the box alone, on a grid coarsened twice, with what is known of the estimate."""
    coarse_shape = tuple(-(-n // 4) for n in shape)
    coarse = replace(random_velocity(2, voxel_size=4.0, shape=coarse_shape), closed=("y-",))
    found, expected = refine_in_box(coarse, shape, box), part_of(refine(coarse, shape), box)
    assert found.voxel_size == 1.0
    assert found.closed == expected.closed == (("y-",) if box[1].start == 0 else ())
    for mine, other in zip(found.faces, expected.faces, strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-6)
