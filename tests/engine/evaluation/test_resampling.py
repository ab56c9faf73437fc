"""Volumes on other grids over the same box."""

from __future__ import annotations

import numpy as np

from smokelift.evaluation.resampling import resampled


def test_other_resolutions_over_the_same_box() -> None:
    """Means on a coarser grid, interpolation on a finer one; each axis its own."""
    density = np.random.default_rng(0).random((8, 12, 10)).astype(np.float32)
    fine = density.repeat(2, 0).repeat(2, 1).repeat(2, 2)
    np.testing.assert_allclose(resampled(fine, (8, 12, 10)), density, atol=1e-6)
    ramp = np.broadcast_to(np.arange(8, dtype=np.float32)[:, None, None, None] + 0.5, (8, 4, 6, 3))
    found = resampled(np.ascontiguousarray(ramp), (16, 8, 12))
    assert found.shape == (16, 8, 12, 3)
    np.testing.assert_allclose(
        found[1:-1], np.broadcast_to(((np.arange(16) + 0.5) / 2)[1:-1, None, None, None], found[1:-1].shape)
    )
