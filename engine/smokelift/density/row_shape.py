"""The rows of a picture of smoke: where their smoke is, how wide it is, and what is finer than that."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]

DETAIL = 0.6
"""Standard deviation of the blur that takes the detail away, in widths of the smoke. The rows' amounts, middles and
widths, which one picture of smoke tells about its sides, are coarser (docs/experiments/depth-detail.md)."""

ROWS = 4.0
"""Standard deviation (rows) over which middles and widths are smoothed: a row's own lean is detail."""


def middles_and_widths(picture: Array) -> tuple[Array, Array]:
    """Return where the smoke of each row is.

    Parameters
    ----------
    picture : (rows, columns)
        Optical depth, not zero everywhere.

    Returns
    -------
    (rows,)
        Mean column, smoothed over the rows; the neighbours' in empty rows.
    (rows,)
        Standard deviation (columns, at least 1), likewise.
    """
    columns, amount = np.arange(picture.shape[1]), picture.sum(1)
    known = amount > 1e-6 * amount.max()
    weight = ndimage.gaussian_filter1d(amount, ROWS) + 1e-9 * amount.max()

    def smoothed(values: Array) -> Array:
        mean = ndimage.gaussian_filter1d(np.where(known, amount * values, 0), ROWS) / weight
        return np.asarray(np.interp(np.arange(len(mean)), np.flatnonzero(known), mean[known]), np.float64)

    mean = picture @ columns / np.maximum(amount, 1e-30)
    variance = np.sum(picture * (columns - mean[:, None]) ** 2, 1) / np.maximum(amount, 1e-30)
    return smoothed(mean), np.sqrt(np.maximum(smoothed(variance), 1))


def mean_width(picture: Array, widths: Array) -> float:
    """Return the mean of the rows' widths (columns), which count by their smoke in the picture (rows, columns)."""
    return float(np.average(widths, weights=picture.sum(1)))


def coarse(picture: Array, width: float) -> Array:
    """Return a picture (rows, columns) without the detail of smoke that is so many columns wide."""
    return np.asarray(ndimage.gaussian_filter(picture, max(DETAIL * width, 1.0)))
