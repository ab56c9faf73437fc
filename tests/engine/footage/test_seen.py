"""Medians over time of what is seen."""

import numpy as np
import pytest

from smokelift import _core
from smokelift.footage.seen import median_of_seen


@pytest.mark.parametrize("shape", [(1, 3), (2, 70), (5, 4, 3), (16, 9, 11, 3), (31, 64), (40, 1)])
def test_medians_are_those_of_numpy(shape: tuple[int, ...]) -> None:
    """Of one frame, of more and fewer places than are ordered at a time, and where values come more than once."""
    random = np.random.default_rng(0)
    for values in (random.standard_normal(shape).astype(np.float32), random.integers(0, 3, shape).astype(np.float32)):
        assert np.array_equal(_core.at_ranks(values, range(len(values))), np.sort(values, axis=0))
        assert np.array_equal(median_of_seen(values), np.median(values, axis=0))


@pytest.mark.filterwarnings("ignore:All-NaN slice")
def test_what_is_not_seen_counts_for_nothing() -> None:
    values = np.random.default_rng(0).random((7, 5, 6), np.float32)
    values[2:4, :, 1] = np.nan
    values[2:5, :, 2] = np.nan
    values[:, 0, 0] = np.nan
    np.testing.assert_array_equal(median_of_seen(values), np.nanmedian(values, axis=0))
