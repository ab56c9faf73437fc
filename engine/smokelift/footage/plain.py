"""Backgrounds of one colour, found on glimpses of a clip: what has no detail loses none.

Most stock footage stands before one colour. Its pictures are large, and to find that out on all of their pixels costs
more than all else that is looked at before a run.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from smokelift.footage.clip import Clip
from smokelift.footage.evidence import GLIMPSE, glimpses
from smokelift.footage.exposure import sample_gains, small
from smokelift.footage.images import Picture, area_average
from smokelift.footage.noise import BLOCK, Noise, encode_sample
from smokelift.footage.plate import Plate
from smokelift.footage.plate_estimation import backdrop_plate, clip_noise

SAMPLES = 16
"""Frames from which the colour and the noise are taken."""

APART = 3
"""Blocks from one row or column of them to the next that tell both: a median of so many needs no more."""


def plain_plate(clip: Clip, shot: Clip) -> Plate | None:
    """Return the plate of a background that has one colour everywhere; None of others, and of small pictures.

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
    if divisor < 2 or min(width, height) < APART * BLOCK:
        return None
    columns, rows = round(width / divisor), max(1, round(height / divisor))
    seen = [area_average(glimpse, columns, rows) for glimpse in glimpses(clip, shot)]
    if _colour(seen, [small(glimpse) for glimpse in seen]) is None:
        return None
    parts, whole = [], []
    for number in clip.spread(SAMPLES):
        frame = clip.frame(number)
        parts.append(_some_blocks(frame))
        whole.append(small(frame))
    found = _colour(parts, whole)
    if found is None:
        return None
    colour, noise = found
    return Plate(np.tile(colour, (height, width, 1)), np.ones((height, width), np.float32), noise)


def _colour(pictures: Sequence[Picture], whole: Sequence[Picture]) -> tuple[Picture, Noise] | None:
    """The linear colour (3,) of all of the background and the noise, or None if it has other colours.

    Parameters
    ----------
    pictures
        Linear, of one size.
    whole
        What shows the exposure of each: the `small` picture of its frame.
    """
    gains = sample_gains(np.stack(whole))
    samples: npt.NDArray[np.uint16] = np.empty((len(pictures), *pictures[0].shape), np.uint16)
    for sample, picture, gain in zip(samples, pictures, gains, strict=True):
        sample[...] = encode_sample(picture / gain)
    noise = clip_noise(samples)
    found = backdrop_plate(samples, noise)
    if found is None or (found.image != found.image[0, 0]).any():
        return None
    return found.image[0, 0], noise


def _some_blocks(picture: Picture) -> Picture:
    """A picture of some blocks, side by side, of those whose means tell the noise that lasts."""
    step = APART * BLOCK
    rows, columns = (n // step for n in picture.shape[:2])
    whole = picture[: rows * step, : columns * step].reshape(rows, step, columns, step, 3)
    return np.ascontiguousarray(whole[:, :BLOCK, :, :BLOCK]).reshape(rows * BLOCK, columns * BLOCK, 3)
