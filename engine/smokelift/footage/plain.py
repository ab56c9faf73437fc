"""Backgrounds of one colour, found on pictures smaller than the clip's: what has no detail loses none.

Most stock footage stands before one colour. Its pictures are large, and to find that out on all of their pixels costs
more than all else that is looked at before a run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from smokelift.footage.clip import Clip
from smokelift.footage.exposure import sample_gains, small
from smokelift.footage.images import Picture, area_average
from smokelift.footage.noise import BLOCK, encode_sample, linear_samples
from smokelift.footage.plate import Plate
from smokelift.footage.plate_estimation import backdrop_plate, clip_noise

LONGEST = 640
"""Pixels along the longer side of the small pictures at least: their blocks are a hundredth of the picture's side."""

APART = 3
"""Blocks from one row or column of them to the next whose noise is measured: a median of so many needs no more."""

SAMPLES, FEW = 32, 4
"""Frames that are looked at, and those of them that tell whether it may be one colour at all."""

Sample = npt.NDArray[np.uint16]


def plain_plate(clip: Clip) -> Plate | None:
    """Return the plate of a background that has one colour everywhere; None of others, and of small pictures.

    Parameters
    ----------
    clip
        Camera and background stand still.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    width, height = clip.size
    divisor = max(width, height) // LONGEST
    if divisor < 2 or min(width, height) < APART * BLOCK:
        return None
    whole, blocks = [], []
    for number in clip.spread(SAMPLES):
        frame = clip.frame(number)
        whole.append(area_average(frame, round(width / divisor), max(1, round(height / divisor))))
        blocks.append(encode_sample(_some_blocks(frame)))
        if len(whole) == FEW and _backdrop(whole, blocks, divisor) is None:
            return None
    found = _backdrop(whole, blocks, divisor)
    if found is None or (found.image != found.image[0, 0]).any():
        return None
    image = np.tile(found.image[0, 0], (height, width, 1))
    return Plate(image, np.ones((height, width), np.float32), found.noise)


def _backdrop(whole: Sequence[Picture], blocks: Sequence[Sample], divisor: int) -> Plate | None:
    """The `backdrop_plate` of small pictures, with the noise of the large ones.

    Parameters
    ----------
    whole : (rows, columns, 3) each
        Small linear pictures, whose sides are those of the clip's divided by ``divisor``.
    blocks
        Of each the `_some_blocks`, encoded.
    """
    gains = sample_gains(np.stack([small(picture) for picture in whole]))
    samples = np.stack([encode_sample(picture / gain) for picture, gain in zip(whole, gains, strict=True)])
    steady = [
        each if (gain == 1).all() else encode_sample(linear_samples(each) / gain)
        for each, gain in zip(blocks, gains, strict=True)
    ]
    noise = clip_noise(np.stack(steady))
    found = backdrop_plate(samples, noise.averaged(divisor**2))
    return None if found is None else replace(found, noise=noise)


def _some_blocks(picture: Picture) -> Picture:
    """A picture of some blocks, side by side, of those whose means tell the noise that lasts."""
    rows, columns = (n // (APART * BLOCK) for n in picture.shape[:2])
    step = APART * BLOCK
    whole = picture[: rows * step, : columns * step].reshape(rows, step, columns, step, 3)
    return np.ascontiguousarray(whole[:, :BLOCK, :, :BLOCK]).reshape(rows * BLOCK, columns * BLOCK, 3)
