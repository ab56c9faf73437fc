"""Where and how bright the smoke of a clip is, at reduced size: what camera, domain and light are guessed from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plates

SAMPLES = 16
"""Frames that are looked at."""

LONGEST_SIDE = 320
"""Pixels along the longer side of the reduced pictures."""


@dataclass(frozen=True, eq=False)
class SmokeSamples:
    """Where and how bright smoke is in some frames, at reduced size.

    Attributes
    ----------
    scale
        Full pixels to a reduced one.
    covered : (rows, columns) bool
        Pixels with smoke in at least one sample.
    colours : (n, 3)
        Radiance of all smoke pixels.
    behind : (n, 3)
        Background radiance at the same pixels.
    smoky
        Numbers of the frames with smoke, those with the most first.
    """

    scale: float
    covered: NDArray[np.bool_]
    colours: NDArray[np.float32]
    behind: NDArray[np.float32]
    smoky: tuple[int, ...]


def sample_smoke(clip: Clip, plates: Plates) -> SmokeSamples:
    """Find the smoke in frames spread over a clip."""
    width, height = clip.size
    scale = max(1.0, max(width, height) / LONGEST_SIDE)
    columns, rows = max(1, round(width / scale)), max(1, round(height / scale))
    covered = np.zeros((rows, columns), np.bool_)
    colours, behind = [], []
    amounts: dict[int, int] = {}
    for number in clip.spread(SAMPLES):
        plate = plates.at(number).through(lambda whole: area_average(whole, columns, rows), scale**2)
        picture = area_average(clip.frame(number), columns, rows)
        mask = matte(picture, plate).mask
        covered |= mask
        colours.append(picture[mask])
        behind.append(plate.image[mask])
        if mask.any():
            amounts[number] = int(mask.sum())
    smoky = tuple(sorted(amounts, key=lambda number: -amounts[number]))
    return SmokeSamples(scale, covered, np.concatenate(colours), np.concatenate(behind), smoky)
