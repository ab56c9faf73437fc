"""Directions that light is tried from."""

from __future__ import annotations

import numpy as np

from smokelift.setup.sphere import spread


def test_directions_are_spread_evenly() -> None:
    """No two are close, and none is far from all others."""
    ways = spread(48)
    np.testing.assert_allclose(np.linalg.norm(ways, axis=1), 1)
    between = np.degrees(np.arccos(np.clip(ways @ ways.T - 2 * np.eye(48), -1, 1))).min(1)
    assert 20 < between.min() <= between.max() < 35
