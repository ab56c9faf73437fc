"""Quantiles over time of what is seen."""

import numpy as np
import pytest

from smokelift import _core
from smokelift.footage.seen import median_of_seen, quantile_of_seen


@pytest.mark.parametrize("shape", [(1, 3), (2, 70), (5, 4, 3), (16, 9, 11, 3), (31, 64), (40, 1)])
def test_quantiles_are_those_of_numpy(shape: tuple[int, ...]) -> None:
    """Of one frame, of more and fewer places than are ordered at a time, and where values come more than once."""
    random = np.random.default_rng(0)
    for values in (random.standard_normal(shape).astype(np.float32), random.integers(0, 3, shape).astype(np.float32)):
        assert np.array_equal(_core.at_ranks(values, range(len(values))), np.sort(values, axis=0))
        assert np.array_equal(median_of_seen(values), np.median(values, axis=0))
        for share in (0.0, 0.05, 0.5, 0.9, 1.0):
            expected = np.quantile(values, share, axis=0)
            np.testing.assert_allclose(quantile_of_seen(values, share), expected, rtol=1e-6, atol=1e-6)


def test_what_is_not_seen_counts_for_nothing() -> None:
    values = np.random.default_rng(0).random((7, 5, 6), np.float32)
    values[2:4, :, 1] = np.nan
    values[:, 0, 0] = np.nan
    for share in (0.3, 0.9):
        expected = np.full((5, 6), np.nan)
        for place in np.ndindex(5, 6):
            seen = values[:, *place][~np.isnan(values[:, *place])]
            if seen.size:
                expected[place] = np.quantile(seen, share)
        np.testing.assert_allclose(quantile_of_seen(values, share), expected, rtol=1e-6)
