"""What frames say of their background."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.footage.background_kind import colour_around


def test_a_single_picture_has_a_colour_around_it() -> None:
    """In noise, too, behind smoke that covers most of it and comes in from one side; not a wall, and no black bars."""
    picture = np.full((60, 80, 3), 0.2, np.float32)
    picture += np.random.default_rng(0).normal(0, 0.004, picture.shape).astype(np.float32)
    picture[5:, 10:70] = np.linspace(0.3, 0.9, 60)[:, None]
    assert colour_around(picture) == pytest.approx((0.2, 0.2, 0.2), abs=0.002)
    picture[:, 10:70] = np.linspace(0.3, 0.9, 60)[:, None]
    assert colour_around(picture) is None
    bars = np.kron(np.random.default_rng(0).uniform(0.1, 0.6, (12, 16, 1)), np.ones((5, 5, 3))).astype(np.float32)
    assert colour_around(bars) is None
    bars[:10] = bars[-10:] = 0
    assert colour_around(bars) is None
