"""Medians over time of pixels that are seen in some frames only: what is not seen is not a number."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import smokelift._core as _core


def median_of_seen(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the median along the first axis of what is seen; not a number where nothing is."""
    if not np.isnan(values).any():
        lower, upper = _core.at_ranks(values, ((len(values) - 1) // 2, len(values) // 2))
    else:
        ordered, count = np.sort(values, axis=0), np.maximum(count_of_seen(values), 1)  # what is not seen comes last
        lower, upper = at_rank(ordered, (count - 1) // 2), at_rank(ordered, count // 2)
    return np.asarray((lower + upper) / np.float32(2), np.float32)


def count_of_seen(values: npt.NDArray[np.float32]) -> npt.NDArray[np.intp]:
    """Return how many values along the first axis are seen."""
    return np.asarray(np.count_nonzero(~np.isnan(values), axis=0))


def at_rank(ordered: npt.NDArray[np.float32], rank: npt.NDArray[np.intp]) -> npt.NDArray[np.float32]:
    """Return the value of a rank of each pixel, from 0, of values that are ordered along the first axis."""
    return np.asarray(np.take_along_axis(ordered, rank[None], 0)[0])
