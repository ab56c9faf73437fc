"""What every estimator has in common."""

import numpy as np
import pytest

from smokelift.transport import divergence, face_shapes, part_of
from smokelift.velocity import Velocity, estimate_velocity, predict_velocity
from smokelift.velocity.estimator import refined_in, refined_to
from tests.engine.velocity.known_motions import DT, SHAPE, VOXEL, rotation


def test_prediction_is_free_of_divergence_and_keeps_a_uniform_flow():
    zero = Velocity.zero(SHAPE, VOXEL).faces
    uniform = Velocity([np.full_like(a, v) for a, v in zip(zero, (0.3, -0.2, 0.5), strict=True)], VOXEL)
    for a, b in zip(predict_velocity(uniform, DT).faces, uniform.faces, strict=True):
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
    rng = np.random.default_rng(2)
    coarse_shape = tuple(-(-n // 4) for n in shape)
    coarse = Velocity(
        tuple(rng.standard_normal(n).astype(np.float32) for n in face_shapes(coarse_shape)),
        4.0,
        ("y-",),
        confidence=rng.random(coarse_shape, np.float32),
    )
    found, expected = refined_in(coarse, shape, box), part_of(refined_to(coarse, shape), box)
    assert found.voxel_size == 1.0
    assert found.closed == expected.closed == (("y-",) if box[1].start == 0 else ())
    for mine, other in zip(found.faces, expected.faces, strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-6)
    np.testing.assert_array_equal(found.confidence, expected.confidence)
