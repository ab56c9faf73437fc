"""The exposure of a frame against its background: a gain a channel, measured on what does not move.

Smoke spreads the ratio of a frame to its background; what shows no smoke has one ratio, the gain. So the gain is the
middle of the shortest interval of ratios that holds a third of the picture (the shorth: Andrews et al., "Robust
estimates of location", 1972).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from smokelift.footage.images import Picture, area_average, reduced_size
from smokelift.footage.noise import median_of_seen

COMPARED_SIDE = 160
"""Pixels along the longer side of the pictures that are compared: noise is averaged out, and there are thousands."""

USABLE = (0.005, 0.9)
"""Linear values between which a ratio says anything: below is noise, above is clipped."""

MIN_USABLE_SHARE = 0.01
"""Share of the picture that has to be usable, at least."""

AGREEING = 1 / 3
"""Share of the usable pixels that has to show one gain."""

UNCHANGED = 0.1
"""Share of the usable pixels that proves, by a ratio of one, that the exposure has not changed."""

SAME = 0.02
"""Relative difference of gains that no picture shows: it is less than a step of 8 bit video."""

SPREAD = 0.06
"""Most spread of the ratios of pixels that show one gain."""


def gain_of(picture: Picture, background: Picture) -> Picture:
    """Return how much brighter a picture is than its background, (3,); ones where that cannot be measured or seen.

    Both are linear (rows, columns, 3), `small` enough that their noise does not count.
    """
    gains = np.ones(3, np.float32)
    usable = _usable(background) & _usable(picture)
    if usable.mean() < MIN_USABLE_SHARE:
        return gains
    ratios = np.log(picture[usable] / background[usable])
    if _all_three(np.abs(ratios) < SAME).mean() >= UNCHANGED:
        return gains
    middle, spread = zip(*(_shorth(ratios[:, channel]) for channel in range(3)), strict=True)
    if max(spread) > SPREAD:
        return gains
    return np.exp(np.array(middle, np.float32))


def shows_exposure(background: Picture) -> bool:
    """Return whether a linear background (rows, columns, 3) is bright enough somewhere, and not too bright, to tell."""
    return bool(_usable(background).mean() >= MIN_USABLE_SHARE)


def small(picture: Picture) -> Picture:
    """Return a picture at the size at which gains are measured."""
    rows, columns = picture.shape[:2]
    return area_average(picture, *reduced_size(columns, rows, COMPARED_SIDE))


def sample_gains(samples: npt.NDArray[np.float32]) -> Picture:
    """Return the gains (frames, 3) of small linear pictures (frames, rows, columns, 3) against their median.

    What a picture does not show is not a number.
    """
    gains = np.ones((len(samples), 3), np.float32)
    for _ in range(3):  # the median of unsteady frames is less certain than that of steady ones
        reference = median_of_seen(samples / gains[:, None, None])
        before, gains = gains, np.stack([gain_of(sample, reference) for sample in samples])
        if (gains == before).all():  # as they would stay
            break
    return gains


def _usable(picture: Picture) -> npt.NDArray[np.bool_]:
    return _all_three((picture > USABLE[0]) & (picture < USABLE[1]))


def _all_three(holds: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Where something holds in all channels (..., 3); NumPy's ``all`` takes much longer along so short an axis."""
    red, green, blue = np.moveaxis(holds, -1, 0)
    return np.asarray(red & green & blue)


def _shorth(values: npt.NDArray[np.float32]) -> tuple[float, float]:
    """Middle and width of the shortest interval that holds the share `AGREEING` of some values."""
    ordered = np.sort(values)
    count = max(1, int(AGREEING * len(ordered)))
    widths = ordered[count - 1 :] - ordered[: len(ordered) - count + 1]
    first = int(widths.argmin())
    return float(np.median(ordered[first : first + count])), float(widths[first])
