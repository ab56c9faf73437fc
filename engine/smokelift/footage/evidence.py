"""How much of a file shows what a clip of it does: all of that is evidence for the background, whatever is trimmed."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.clip import Clip, ClipError
from smokelift.footage.exposure import LONGEST, gain_of, small
from smokelift.footage.images import Picture, Value, linear_to_srgb

SAMPLES = 24
"""Frames of the file that are compared, and as many of the clip at most."""

SAMPLES_OF_LARGE = 16
"""The same where pictures are large, as many as are looked at whole anyway."""

GLIMPSE = 4 * LONGEST
"""Pixels along the longer side of what is read, four for each one that is compared: light is averaged over them."""

STILL = 4 / 255
"""Change of a pixel, in sRGB values, up to which it has not changed."""

SAME_SHOT = 0.25
"""Share of the pixels that do not change within the clip which a frame of the same shot leaves as they are; smoke may
be over the others."""


def are_large(clip: Clip) -> bool:
    """Return whether the pictures of a clip are larger than glimpses at them."""
    return max(clip.size) >= 2 * GLIMPSE


def looks(clip: Clip) -> list[int]:
    """Return the numbers of the frames of a clip that are compared."""
    return clip.spread(SAMPLES_OF_LARGE if are_large(clip) else SAMPLES)


def evidence(clip: Clip) -> Clip:
    """Return the part of a clip's file around it that was filmed in one shot with it.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    whole = clip.whole()
    if len(whole) == len(clip):
        return clip
    own = np.stack([small(clip.glimpse(number, GLIMPSE)) for number in looks(clip)])
    reference = np.median(own, axis=0)
    still = np.quantile(np.abs(linear_to_srgb(own) - linear_to_srgb(reference)).max(-1), 0.9, axis=0) < STILL
    first, last = clip.first, clip.first + len(clip) - 1
    numbers = looks(whole)
    for number in [n for n in numbers if n > last]:
        if not _same(whole, number, reference, still):
            break
        last = number
    start = None
    for number in [n for n in numbers if n < first]:  # backwards each would be decoded from the last key frame on
        if not _same(whole, number, reference, still):
            start = None
        elif start is None:
            start = number
    return whole.part(first if start is None else start, last)


def glimpses(clip: Clip, shot: Clip, look: Callable[[Clip, int], NDArray[Value]]) -> Iterator[NDArray[Value]]:
    """Look again, in some way, at the frames from which `evidence` found that a clip belongs to a shot."""
    yield from (look(clip, number) for number in looks(clip))
    if len(shot) > len(clip):
        whole = clip.whole()
        for number in looks(whole):
            if 0 <= number - shot.first < len(shot) and not 0 <= number - clip.first < len(clip):
                yield look(whole, number)


def linear(values: Picture) -> Picture:
    """Return linear values as they are."""
    return values


def _same(whole: Clip, number: int, reference: Picture, still: NDArray[np.bool_]) -> bool:
    """Whether a frame of the file can be read and belongs to the shot."""
    try:
        picture = small(whole.glimpse(number, GLIMPSE))
    except ClipError:
        return False
    if not still.any():
        return True
    alike = np.abs(linear_to_srgb(picture / gain_of(picture, reference)) - linear_to_srgb(reference)).max(-1) < STILL
    return bool(alike[still].mean() >= SAME_SHOT)
