"""Sources: what counts as smoke that enters, and what does not."""

import numpy as np
import pytest

from smokelift.direct.source_detection import SourceDetection

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
    unexplained = DETECTION.means(left, np.ones(SHAPE, np.float32), past)
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
    plain = DETECTION.weight(DETECTION.means(left, density, None), density > 0)
    scaled = DETECTION.means(np.float32(scale) * left, np.float32(scale) * density, None)
    np.testing.assert_allclose(DETECTION.weight(scaled, density > 0), plain, atol=1e-4)
