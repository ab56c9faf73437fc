"""Where and how bright the smoke of a clip is, at reduced size: what camera, domain and light are estimated from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.clip import Clip
from smokelift.footage.exposure import largest_change, small
from smokelift.footage.images import area_average
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plates
from smokelift.footage.steady import exposures
from smokelift.setup.thickness import seen_texture

SAMPLE_FRAMES, SAMPLE_SIDE = 16, 320
"""Frames that are examined, and pixels along their longer side."""

UNKNOWN = 0.5
"""Confidence of a plate below which what is behind the smoke is unknown there."""


@dataclass(frozen=True, eq=False)
class SmokeSamples:
    """Where and how bright smoke is in some frames, at reduced size.

    Attributes
    ----------
    scale
        Full pixels to a reduced one.
    bounds
        Left, top, right and bottom of ``covered`` in pixels of the camera's full picture.
    covered : (rows, columns) bool
        Pixels with smoke in at least one sample.
    unknown : (rows, columns) bool
        Pixels whose background is unknown, likewise.
    colours : (n, 3)
        Radiance of all smoke pixels.
    behind : (n, 3)
        Background radiance at the same pixels.
    smoky
        Numbers of the frames with smoke, those with the most first.
    gains
        By how much each sample is brighter than its background, (3,), by the number of its frame; they are evened out.
    textures
        What the samples with smoke show of the texture behind it.
    amounts
        Numbers of smoke pixels of the samples that have any, in their order in ``colours``.
    """

    scale: float
    bounds: tuple[float, float, float, float]
    covered: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    colours: NDArray[np.float32]
    behind: NDArray[np.float32]
    smoky: tuple[int, ...]
    gains: Mapping[int, NDArray[np.float32]]
    textures: tuple[NDArray[np.float64], ...] = ()
    amounts: tuple[int, ...] = ()

    @property
    def exposure(self) -> float:
        """Share by which the exposure of a sample differs from its background's at most."""
        return largest_change(list(self.gains.values()))

    @property
    def brightens(self) -> bool:
        """Whether smoke adds more light to what is behind it than it takes away."""
        change = np.sum(self.colours - self.behind, -1)
        return bool(np.sum(np.maximum(change, 0)) >= np.sum(np.maximum(-change, 0)))


def unknown_part(plates: Plates, clip: Clip, number: int) -> NDArray[np.bool_]:
    """Return where the background of a frame is unknown (rows, columns), and no mask hides it."""
    unknown = plates.at(number).confidence < UNKNOWN
    seen = clip.seen(number, *unknown.shape[::-1])
    return unknown if seen is None else unknown & seen


def sample_smoke(clip: Clip, plates: Plates, corner: tuple[int, int] = (0, 0)) -> SmokeSamples:
    """Find the smoke in frames spread over a clip, whose exposure may change.

    Parameters
    ----------
    clip, plates
        The footage, and what is behind the smoke.
    corner
        Left and top of its pictures in pixels of the camera's.
    """
    width, height = clip.size
    scale = max(1.0, max(width, height) / SAMPLE_SIDE)
    columns, rows = (max(1, round(side / scale)) for side in (width, height))
    covered, unknown = np.zeros((2, rows, columns), np.bool_)
    colours, behind, textures = [], [], []
    gains: dict[int, NDArray[np.float32]] = {}
    amounts: dict[int, int] = {}
    reduced = plates.through(lambda whole: area_average(whole, columns, rows), scale**2)
    gains_of = exposures(reduced)
    for number in clip.spread(SAMPLE_FRAMES):
        plate = reduced.at(number)
        seen = clip.stored(number).averaged(columns, rows)
        gains[number] = gains_of(number, small(seen))
        picture = seen / gains[number]
        mask = matte(picture, plate).mask
        covered |= mask
        unknown |= unknown_part(reduced, clip, number)
        colours.append(picture[mask])
        behind.append(plate.image[mask])
        if mask.any():
            amounts[number] = int(mask.sum())
            textures.append(seen_texture(picture, plate, mask))
    smoky = tuple(sorted(amounts, key=lambda number: -amounts[number]))
    left, top = corner
    bounds = (float(left), float(top), float(left + width), float(top + height))
    radiance = np.concatenate(colours), np.concatenate(behind)
    return SmokeSamples(
        scale, bounds, covered, unknown, *radiance, smoky, gains, tuple(textures), tuple(amounts.values())
    )
