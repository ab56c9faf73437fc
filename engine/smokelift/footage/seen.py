"""Quantiles over time of pixels that are seen in some frames only: what is not seen is not a number."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

import smokelift._core as _core


def quantile_of_seen(values: npt.NDArray[np.float32], share: float) -> npt.NDArray[np.float32]:
    """Return a quantile along the first axis of what is seen; not a number where nothing is.

    As `numpy.quantile`, in a tenth of its time, and unlike `numpy.nanquantile` fast for many pixels.
    """
    if not np.isnan(values).any():
        rank = share * (len(values) - 1)
        next_below = math.floor(rank)
        lower, upper = _core.at_ranks(values, (next_below, min(next_below + 1, len(values) - 1)))
        apart, part = (upper - lower).astype(np.float64), rank - next_below
        # from the nearer one, as NumPy does
        found: npt.NDArray[np.float32] = lower + apart * part if part < 0.5 else upper - apart * (1 - part)
        return found
    ordered = np.sort(values, axis=0)  # what is not seen comes last
    last = np.maximum(count_of_seen(values) - 1, 0)
    place = share * last
    low = np.floor(place).astype(np.intp)
    below, above = at_rank(ordered, low), at_rank(ordered, np.minimum(low + 1, last))
    between: npt.NDArray[np.float32] = (below + (place - low) * (above - below)).astype(np.float32)
    return between


def median_of_seen(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the median along the first axis of what is seen; not a number where nothing is."""
    if not np.isnan(values).any():
        lower, upper = _core.at_ranks(values, ((len(values) - 1) // 2, len(values) // 2))
        return np.asarray((lower + upper) / np.float32(2), np.float32)
    return quantile_of_seen(values, 0.5)


def count_of_seen(values: npt.NDArray[np.float32]) -> npt.NDArray[np.intp]:
    """Return how many values along the first axis are seen."""
    return np.asarray(np.count_nonzero(~np.isnan(values), axis=0))


def at_rank(ordered: npt.NDArray[np.float32], rank: npt.NDArray[np.intp]) -> npt.NDArray[np.float32]:
    """Return the value of a rank of each pixel, from 0, of values that are ordered along the first axis."""
    return np.asarray(np.take_along_axis(ordered, rank[None], 0)[0])
