"""Means and flicker where frames are missing."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.evaluation.series import finite_mean, flicker_of


def test_means_leave_out_what_is_infinite_or_unknown() -> None:
    assert finite_mean([1.0, np.inf, None, 3.0]) == 2.0
    assert finite_mean([np.inf, None]) is None
    assert finite_mean([]) is None


def test_flicker_needs_three_frames() -> None:
    one, other = np.ones(4, np.float32), 0.8 * np.ones(4, np.float32)
    assert flicker_of([one, other]) is None
    assert flicker_of([one, one, one]) == 0
    assert flicker_of([one, other, one]) == pytest.approx(0.4 / np.sqrt((2 + 0.64) / 3))
