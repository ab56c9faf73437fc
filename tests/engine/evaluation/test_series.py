"""Means where something is missing."""

from __future__ import annotations

import numpy as np

from smokelift.evaluation.series import finite_mean


def test_means_leave_out_what_is_infinite_or_unknown() -> None:
    assert finite_mean([1.0, np.inf, None, 3.0]) == 2.0
    assert finite_mean([np.inf, None]) is None
    assert finite_mean([]) is None
