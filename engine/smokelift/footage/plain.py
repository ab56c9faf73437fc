"""Backgrounds of one colour, found on glimpses of a clip: what has no detail loses none.

Most stock footage stands before one colour. Its pictures are large, and to find that out on all of their pixels costs
more than all else that is looked at before a run.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from smokelift.footage.backdrop import backdrop_plate
from smokelift.footage.clip import Clip
from smokelift.footage.evidence import GLIMPSE, glimpses, linear
from smokelift.footage.exposure import sample_gains, small, small_size
from smokelift.footage.images import Picture, area_average
from smokelift.footage.noise import BLOCK, BLOCKS_APART, Noise, encode_sample, even_out, some_blocks
from smokelift.footage.plate import Plate
from smokelift.footage.plate_estimation import clip_noise

SAMPLES = 16
"""Frames from which the colour and the noise are taken."""


def plain_plate(clip: Clip, shot: Clip) -> Plate | None:
    """Return the plate of a background that has one colour everywhere; None of others, small and masked ones.

    Parameters
    ----------
    clip
        Camera and background stand still.
    shot
        What of its file was filmed in one shot with it (`evidence`).

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    width, height = clip.size
    divisor = max(width, height) // GLIMPSE
    if clip.mask is not None or divisor < 2 or min(width, height) < BLOCKS_APART * BLOCK:
        return None
    columns, rows = round(width / divisor), max(1, round(height / divisor))
    size = small_size(columns, rows)

    def encoded(of: Clip, number: int) -> npt.NDArray[np.uint16]:
        return of.glimpse_through(number, GLIMPSE, encode_sample)

    seen: list[Picture] = []
    if clip.glimpse(0, GLIMPSE).shape[:2] == (rows, columns):
        tiny = list(glimpses(clip, shot, lambda of, number: of.glimpse_average(number, GLIMPSE, linear, *size)))
    else:
        seen = list(glimpses(clip, shot, lambda of, number: of.glimpse_average(number, GLIMPSE, linear, columns, rows)))
        tiny = [area_average(glimpse, *size) for glimpse in seen]
    if _colour(map(encode_sample, tiny), tiny) is None:  # which most walls show
        return None
    samples = map(encode_sample, seen) if seen else glimpses(clip, shot, encoded)
    if _colour(samples, tiny) is None:
        return None
    numbers = clip.spread(SAMPLES)
    parts = (clip.frame_through(number, encode_sample, some_blocks) for number in numbers)
    found = _colour(parts, [small(clip.reduced(number)) for number in numbers])
    if found is None:
        return None
    colour, noise = found
    return Plate(np.tile(colour, (height, width, 1)), np.ones((height, width), np.float32), noise)


def _colour(encoded: Iterable[npt.NDArray[np.uint16]], whole: Sequence[Picture]) -> tuple[Picture, Noise] | None:
    """The linear colour (3,) of all of the background and the noise, or None if it has other colours.

    Parameters
    ----------
    encoded
        Pictures of one size, as of `encode_sample`.
    whole
        What shows the exposure of each: the `small` picture of its frame.
    """
    samples = np.stack(list(encoded))
    even_out(samples, sample_gains(np.stack(whole)))
    noise = clip_noise(samples)
    found = backdrop_plate(samples, noise)
    if found is None or (found.image != found.image[0, 0]).any():
        return None
    return found.image[0, 0], noise
