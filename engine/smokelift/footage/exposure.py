"""The exposure of a frame against its background: one gain for each channel.

Where there is no smoke, the ratio of a frame to its background is the gain; smoke spreads it. So the gain is the middle
of the shortest interval that holds a third of the ratios (the shorth: Andrews et al., "Robust estimates of location",
1972).
"""

import numpy as np
import numpy.typing as npt

from smokelift.footage.images import Picture, area_average, brightest_channel, reduced_size
from smokelift.footage.noise import median_of_seen

COMPARED_SIDE = 160
"""Pixels along the longer side of compared pictures: few enough to average out noise, and still thousands."""

USABLE = (0.005, 0.9)
"""Linear values between which a ratio is usable: below there is noise, above clipping."""

MIN_USABLE_FRACTION = 0.01
"""Smallest usable fraction of a picture."""

AGREEING = 1 / 3
"""Share of the usable pixels that must show one gain."""

UNCHANGED = 0.1
"""Share of the usable pixels with a ratio of one that proves an unchanged exposure."""

SAME = 0.02
"""Relative difference of gains that is invisible: less than a step of 8 bit video."""

SPREAD = 0.06
"""Largest spread of the log ratios of pixels that show one gain."""


def gain_of(picture: Picture, background: Picture) -> Picture:
    """Return how many times brighter a picture is than its background, (3,); ones if that is not measurable or visible.

    Both are linear (rows, columns, 3) and `small`, so that their noise does not count.
    """
    gains = np.ones(3, np.float32)
    usable = _usable(background) & _usable(picture)
    if usable.mean() < MIN_USABLE_FRACTION:
        return gains
    ratios = np.log(picture[usable] / background[usable])
    if (brightest_channel(np.abs(ratios)) < SAME).mean() >= UNCHANGED:
        return gains
    middle, spread = zip(*(_shorth(ratios[:, channel]) for channel in range(3)), strict=True)
    if max(spread) > SPREAD:
        return gains
    return np.exp(np.array(middle, np.float32))


def shows_exposure(background: Picture) -> bool:
    """Return whether enough of a linear background (rows, columns, 3) is usable to measure gains against it."""
    return bool(_usable(background).mean() >= MIN_USABLE_FRACTION)


def small(picture: Picture) -> Picture:
    """Return a picture at the size that gains are measured at."""
    rows, columns = picture.shape[:2]
    return area_average(picture, *reduced_size(columns, rows, COMPARED_SIDE))


def sample_gains(samples: npt.NDArray[np.float32]) -> Picture:
    """Return gains (frames, 3) of small linear pictures (frames, rows, columns, 3) to their median; NaN is unseen."""
    gains = np.ones((len(samples), 3), np.float32)
    for _ in range(3):  # frames of one exposure have a more certain median than those of several
        reference = median_of_seen(samples / gains[:, None, None])
        before, gains = gains, np.stack([gain_of(sample, reference) for sample in samples])
        if (gains == before).all():  # converged
            break
    return gains


def _usable(picture: Picture) -> npt.NDArray[np.bool_]:
    return np.asarray((brightest_channel(-picture) < -USABLE[0]) & (brightest_channel(picture) < USABLE[1]))


def _shorth(values: npt.NDArray[np.float32]) -> tuple[float, float]:
    """Middle and width of the shortest interval that holds the fraction `AGREEING` of the values."""
    ordered = np.sort(values)
    count = max(1, int(AGREEING * len(ordered)))
    widths = ordered[count - 1 :] - ordered[: len(ordered) - count + 1]
    first = int(widths.argmin())
    return float(np.median(ordered[first : first + count])), float(widths[first])
