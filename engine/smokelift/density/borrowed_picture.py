"""The picture from a side: what is known of it, with the detail of a picture of another moment.

The smooth answer knows how much smoke every row of the side's picture holds, where its middle is and how wide it is.
How the smoke is spread within the row it does not know. That is borrowed: the other moment's picture is moved and
stretched row by row until its rows have those middles and widths, and its detail, relative to its own blurred picture,
multiplies the blurred picture of the smooth answer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from smokelift.density.row_shape import Array, coarse, mean_width, middles_and_widths

LARGEST = 2.5
"""Bound of the detail's ratio to the blurred picture: beyond it lies an edge, where the blurred picture is thin."""

FAINT = 1e-3
"""Share of the largest blurred value below which a ratio means nothing."""

OUTLINE = 4.0
"""The target falls to zero where the ratio is below one part in so many: outside the borrowed outline is no smoke."""

END = 0.02
"""Share of the smoke beyond the rows at which it is said to begin and end."""


def borrowed_picture(smooth: Array, others: Sequence[tuple[float, Array]]) -> Array | None:
    """Return the smooth answer's picture with the detail of others.

    Parameters
    ----------
    smooth : (rows, columns)
        Optical depth of the smooth answer from the side.
    others
        Shares that add up to 1, and pictures (rows, columns) of other moments, which are dissolved into one another.
        A mean of unlike details is fainter than either, so that it is strengthened by what the mean loses.

    Returns
    -------
    (rows, columns), every row with the sum of the smooth answer's; None if no other picture shows smoke.
    """
    shown = [(share, picture) for share, picture in others if share > 0 and picture.any()]
    if not shown or not smooth.any():
        return None
    total = sum(share for share, _ in shown)
    middles, widths = middles_and_widths(smooth)
    width = mean_width(smooth, widths)
    known = coarse(smooth, width)
    fitted = [(share / total, _fitted(picture, smooth, middles, widths)) for share, picture in shown]
    details = [(share, _relative(picture, width) - 1) for share, picture in fitted]
    mean = sum(share * detail for share, detail in details)
    left, own = np.linalg.norm(known * mean), sum(share * np.sum((known * detail) ** 2) for share, detail in details)
    ratio = 1 + mean * (np.sqrt(own) / left if left > 0 else 1.0)
    target = known * np.clip(ratio, 0, LARGEST) * np.clip(OUTLINE * ratio, 0, 1)
    return _with_rows(target, smooth.sum(1))


def _fitted(other: Array, smooth: Array, middles: Array, widths: Array) -> Array:
    """The other picture, its rows moved to where the smooth picture has theirs, as wide and with as much smoke."""
    rows = matching_rows(smooth.sum(1), other.sum(1))
    other_middles, other_widths = (np.interp(rows, np.arange(len(other)), of) for of in middles_and_widths(other))
    columns = np.arange(smooth.shape[1])
    at = other_middles[:, None] + (columns - middles[:, None]) * (other_widths / widths)[:, None]
    fitted = ndimage.map_coordinates(other, (np.broadcast_to(rows[:, None], at.shape), at), order=1, mode="constant")
    return _with_rows(ndimage.gaussian_filter(fitted, (0.6, 0.5)), smooth.sum(1))


def matching_rows(amounts: Array, others: Array) -> Array:
    """Return which row of another picture belongs to each row of a picture: both smokes begin and end alike.

    Parameters
    ----------
    amounts, others : (rows,)
        Smoke in the rows of both.

    Returns
    -------
    (rows,), fractional, evenly spaced. Equal shares of the smoke would flicker: they stretch parts of the picture anew
    in every frame.
    """
    first, last = _ends(amounts)
    other_first, other_last = _ends(others)
    stretch = max(other_last - other_first, 1.0) / max(last - first, 1.0)
    return np.asarray(other_first + (np.arange(len(amounts)) - first) * stretch)


def _ends(amounts: Array) -> tuple[float, float]:
    """Rows, fractional, at which the smoke begins and ends."""
    share = np.cumsum(ndimage.gaussian_filter1d(amounts, 1.0)) / amounts.sum()
    first, last = np.interp((END, 1 - END), share + 1e-9 * np.arange(len(share)), np.arange(len(share)))
    return float(first), float(last)


def _relative(picture: Array, width: float) -> Array:
    """A picture in units of itself without the detail of smoke that is so many columns wide."""
    blurred = coarse(picture, width)
    return np.asarray(picture / (blurred + FAINT * blurred.max()))


def _with_rows(picture: Array, sums: Array) -> Array:
    """A picture with the rows scaled to some sums."""
    return np.asarray(picture * (sums / np.maximum(picture.sum(1), 1e-30))[:, None])
