"""Sources: what counts as smoke that enters, and what does not."""

import numpy as np
import pytest

from smokelift.velocity import SourceDetection

DETECTION = SourceDetection()
SHAPE = (24, 24, 32)
INLET = (slice(8, 14), slice(8, 14), slice(4, 10))
FRONT = (slice(4, 20), slice(4, 20), slice(24, 29))


def residual(inlet=0.0, front=0.0):
    """What motion that is a little wrong leaves, with new smoke in an inlet and before a front."""
    x, y, z = np.indices(SHAPE)
    left = 0.02 * np.sin(1.3 * x) * np.cos(1.1 * y) * np.sin(0.9 * z)
    left[INLET] += inlet
    left[FRONT] += front
    return left.astype(np.float32)


def weight(left, past=None):
    unexplained = DETECTION.means(left, np.ones(SHAPE, np.float32), 1.0, past)
    return DETECTION.weight(unexplained, np.ones(SHAPE, bool)), unexplained


def test_an_inlet_is_found():
    found, _ = weight(residual(inlet=0.5))
    assert found[10, 10, 7] == 0
    assert found[FRONT].min() > 0.9


def test_motion_that_is_wrong_is_no_source():
    found, _ = weight(residual())
    assert found.min() > 0.9


def test_a_weak_front_beside_an_inlet_is_none():
    alone, _ = weight(residual(front=0.05))
    beside, _ = weight(residual(front=0.05, inlet=1.0))
    assert alone[12, 12, 26] < 0.1
    assert beside[12, 12, 26] == 1
    assert beside[10, 10, 7] == 0


def test_inlets_are_remembered_and_what_passes_is_not():
    past = None
    for _ in range(8):
        _, past = weight(residual(inlet=0.5), past)
    missed, _ = weight(residual(), past)
    passing, _ = weight(residual(inlet=0.5, front=0.2), past)
    at_once, _ = weight(residual(inlet=0.5, front=0.2))
    assert missed[10, 10, 7] == 0
    assert at_once[12, 12, 26] < 0.1
    assert passing[12, 12, 26] > 0.8
    for _ in range(40):
        closed, past = weight(residual(), past)
    assert closed[10, 10, 7] > 0.9


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_scale_of_density_does_not_matter(scale):
    left, density = residual(inlet=0.5), np.ones(SHAPE, np.float32)
    plain = DETECTION.weight(DETECTION.means(left, density, 1.0, None), density > 0)
    scaled = DETECTION.means(np.float32(scale) * left, np.float32(scale) * density, 1.0, None)
    np.testing.assert_allclose(DETECTION.weight(scaled, density > 0), plain, atol=1e-4)


def first_weight(*speeds):
    """How far smoke of some speeds (voxels a frame), in slabs side by side, is believed at first."""
    x = np.indices(SHAPE)[0] * len(speeds) // SHAPE[0]
    steepness = np.ones(SHAPE, np.float32)
    change = np.take(np.float32(speeds), x)
    weight = DETECTION.first_weight((steepness, 0 * steepness, 0 * steepness), change, np.ones(SHAPE, bool))
    middles = (np.arange(len(speeds)) + 0.5) * SHAPE[0] / len(speeds)
    return [weight[int(middle), 12, 16] for middle in middles]


def test_smoke_that_stands_still_among_moving_smoke_may_be_an_inlet():
    still, usual, fast = first_weight(0.0, 1.0, 20.0)
    assert still < 0.001
    assert usual == pytest.approx(1 / (1 + DETECTION.still**2), rel=0.05)
    assert fast > 0.8


def test_where_most_smoke_is_at_rest_it_is_believed():
    assert min(first_weight(0.0, 0.0, 2.0)) > 0.99


def test_even_smoke_and_no_smoke_have_finite_weights():
    even = np.zeros(SHAPE, np.float32)
    for smoke in (np.ones(SHAPE, bool), np.zeros(SHAPE, bool)):
        assert np.isfinite(DETECTION.first_weight((even, even, even), even, smoke)).all()
