"""How much a density changes along the rays, relative to across them."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.evaluation.metrics.anisotropy import depth_anisotropy


def test_depth_anisotropy() -> None:
    """A picture drawn out along an axis has no change there; noise has as much everywhere."""
    rng = np.random.default_rng(3)
    noise = rng.random((20, 24, 28))
    assert depth_anisotropy(noise) == pytest.approx(1, abs=0.02)
    drawn_out = np.repeat(rng.random((20, 1, 28)), 24, 1)
    assert depth_anisotropy(drawn_out) == 0
    assert depth_anisotropy(drawn_out, axis=0) > 1.3
    with pytest.raises(ValueError, match="nx, ny, nz"):
        depth_anisotropy(noise[0])
