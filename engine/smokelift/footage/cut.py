"""A cut inside a clip: what stands behind the smoke is another before and after it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from smokelift.footage.evidence import SAME_SHOT, STILL
from smokelift.footage.exposure import gain_of
from smokelift.footage.images import Picture, brightest_channel, linear_to_srgb

STEADY = 0.5
"""Share of the pixels that stay as they are from one sample to the next on both sides of a cut, at least: where a
camera moves or smoke fills the picture fewer do, all the time."""


def find_cut(numbers: Sequence[int], pictures: Sequence[Picture], picture_of: Callable[[int], Picture]) -> int | None:
    """Return the number of the first frame after a cut; None of a clip without any.

    At a cut most of the picture changes at once and for good. A flash passes, and another exposure is a gain.

    Parameters
    ----------
    numbers
        Of sample frames, ascending.
    pictures
        The `smokelift.footage.exposure.small` picture of each.
    picture_of
        Returns that of any other frame between them.
    """
    shares = [_alike(one, other) for one, other in pairwise(pictures)]
    for k in range(1, len(shares) - 1):
        if shares[k] >= SAME_SHOT or min(shares[k - 1], shares[k + 1]) < STEADY:
            continue
        before, after = (np.median(side, axis=0) for side in (pictures[: k + 1], pictures[k + 1 :]))
        if _alike(before, after) < SAME_SHOT:
            return _first_after(numbers[k], numbers[k + 1], pictures[k], pictures[k + 1], picture_of)
    return None


def _first_after(last: int, first: int, before: Picture, after: Picture, picture_of: Callable[[int], Picture]) -> int:
    """The first frame after a cut between two frames, by bisection."""
    while first - last > 1:
        middle = (last + first) // 2
        picture = picture_of(middle)
        if _alike(before, picture) >= _alike(picture, after):
            last = middle
        else:
            first = middle
    return first


def _alike(one: Picture, other: Picture) -> float:
    """Share of the pixels that are alike in two pictures, at one exposure if that makes more of them so."""
    encoded = linear_to_srgb(one)

    def share(picture: Picture) -> float:
        return float((brightest_channel(np.abs(linear_to_srgb(picture) - encoded)) < STILL).mean())

    found = share(other)
    return found if found >= STEADY else max(found, share(other / gain_of(other, one)))
