"""The plate where smoke hides it in every frame, in turn with the smoke: B from I - S and T, these from B.

A plate that was found in a clip is continued from its surroundings where no frame is clear. But smoke lets through some
of what is there, in each frame another part. What an element leaves of a picture, (I - S) / T, is the plate's; the
clearest frame says it best. Smoke that stands from the first frame to the last shows next to nothing, and what is
behind it stays as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smokelift.extraction.element import BRIGHTNESS_RANGE, FINER, Cells, extracted, source_of
from smokelift.extraction.source import clip_source
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, reduced_size
from smokelift.footage.plate import Plate, Plates

FRAMES, SIDE, TURNS = 8, 96, 4
"""Frames that are extracted, cells along their longer side, and turns. More frames and turns change T rms by .001,
twice the cells by .004 and .01, for four times the time (docs/experiments/hidden-plate.md)."""

RANGE = 0.005, 0.995
"""Quantiles of each channel of what is known of a plate, between which the rest of it is."""

MIN_UNKNOWN = 0.01
"""Smallest share of a plate that has to be unknown for turns to change the smoke."""

CLEAR_TRANSMITTANCE = 0.02
"""Lower bound of T, for division."""


def plates_and_source(clip: Clip, shot: Clip, plates: Plates, smoky: Sequence[int]) -> tuple[Plates, Picture]:
    """Return the plates of a clip, better known if they were found in its ``shot``, and its smoke's source radiance.

    Both clips are at the plates' exposure; ``smoky`` are the frames of `clip_source`.
    """
    source = clip_source(clip, plates, smoky)
    if not isinstance(plates, Plate):
        return plates, source
    better = plate_in_turn(shot, plates, source)
    return better, source if better is plates else clip_source(clip, better, smoky)


def plate_in_turn(clip: Clip, plate: Plate, source: Picture) -> Plate:
    """Return a plate that is better known where its confidence is less than 1.

    ``clip`` is at the plate's exposure. ``source`` (3,) is the usual source radiance of its smoke.
    """
    if (1 - plate.confidence).mean() < MIN_UNKNOWN or not plate.errors.any():
        return plate
    size = reduced_size(*clip.size, SIDE)
    finer = tuple(min(round(FINER * cells), pixels) for cells, pixels in zip(size, clip.size, strict=True))
    pictures = [clip.stored(frame).averaged(*finer) for frame in clip.spread(FRAMES)]
    pixels = clip.size[0] * clip.size[1] / (finer[0] * finer[1])
    first = found = plate.through(lambda part: area_average(part, *finer), pixels)
    behind = area_average(first.image, *size)
    variance = float(np.trace(plate.errors)) / 3
    for _ in range(TURNS):
        best, clearest = np.zeros_like(behind[..., :1]), behind
        for picture in pictures:
            shown, weight = _shown(Cells.of(picture, found, size), source)
            # errors of smoke are much the same in all frames, so a mean of frames is no better than the best of them
            best, clearest = np.maximum(best, weight), np.where(weight > best, shown, clearest)
        left = 1 / (1 + variance * best)
        change = (1 - left) * (clearest - behind)
        found = replace(first, image=_changed(first, change))
    confidence = 1 - (1 - plate.confidence) * area_average(left[..., 0], *clip.size)
    return replace(plate, image=_changed(plate, change), confidence=confidence)


def _shown(cells: Cells, source: Picture) -> tuple[Picture, Picture]:
    """The plate (rows, columns, 3) that a frame's element leaves, and its inverse variance (rows, columns, 1)."""
    fields, deviation, weight = extracted(cells, source)
    opacity, radiance = fields[..., :1], source_of(fields, source)
    clear = np.maximum(1 - opacity, CLEAR_TRANSMITTANCE)
    errors = (
        cells.noise,
        np.square(deviation[..., None] * (source - cells.behind)),
        np.square(BRIGHTNESS_RANGE * opacity * radiance),
    )
    variance = sum(error.mean(-1, keepdims=True) for error in errors)
    return (cells.seen - opacity * radiance) / clear, weight[..., None] * np.square(clear) / variance


def _changed(plate: Plate, change: Picture) -> Picture:
    """A plate's picture with a change (rows, columns, 3) of cells where it is not known."""
    rows, columns = plate.confidence.shape
    unknown = (1 - plate.confidence)[..., None]
    changed = np.maximum(plate.image + unknown * area_average(change, columns, rows), 0)
    known = plate.image[plate.confidence == 1]
    if not len(known):
        return changed
    low, high = np.quantile(known, RANGE, axis=0).astype(np.float32)
    return np.where(unknown > 0, np.clip(changed, low, high), changed)
