"""The plate where smoke hides it in every frame, in turn with the smoke: B from I - S and T, these from B.

A plate that was found in a clip is continued from its surroundings where no frame is clear. But smoke lets through some
of what is there, in each frame another part. The turns start from the plate that explains all frames best: in each of
them it has to be a mixture of smoke and plate, S = (1 - T) J, whatever T, and it goes on from what is known around it,
above and below it, or on its sides, unless it is an object there. Then what an element leaves of a picture,
(I - S) / T, is the plate's; the clearest frame says it best. Smoke that stands from the first frame to the last shows
next to nothing, and what is behind it stays as it was. Of the J that is found before the turns and the one found after
them, that with which the frames are likelier is the smoke's.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smokelift.checks.array_types import Mask
from smokelift.extraction.background_kind import OBJECT
from smokelift.extraction.element import (
    BRIGHTNESS_RANGE,
    FINER,
    OUTLIER_FREEDOM,
    Cells,
    clip_source,
    extracted,
    source_of,
)
from smokelift.extraction.plate import Plate
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, blurred, reduced_size
from smokelift.footage.noise import EIGHT_BIT_STEP

FRAMES, SIDE, TURNS = 8, 96, 4
"""Frames that are extracted, cells along their longer side, and turns. More frames and turns change T rms by .001,
twice the cells by .004 and .01, for four times the time (docs/experiments/hidden-plate.md)."""

RANGE = 0.005, 0.995
"""Quantiles of each channel of what is known of a plate, between which the rest of it is."""

MIXTURES = np.linspace(0, 1, 6)
"""Values of T among which a cell's mixture of smoke and plate is searched."""

CANDIDATES = 1.0, 0.6, 0.36
"""Values of T for which each frame proposes a plate."""

NEIGHBORHOOD = 2.0
"""Standard deviation, in cells, of the Gaussian over which neighbors decide together: T of elements of eleven composed
clips is off by .164, .159 and .158 with 1, 2 and 4, and by .162 cell by cell."""

INDEPENDENT = 3
"""Number of independent frames that the frames count as: errors of smoke last (.75 to .95 from a frame to the next)."""

MIN_UNKNOWN = 0.01
"""Smallest fraction of a plate that has to be unknown for turns to change the smoke."""

CLEAR_TRANSMITTANCE = 0.02
"""Lower bound of T, for division."""


def plate_and_source(clip: Clip, shot: Clip, plate: Plate, smoky: Sequence[int]) -> tuple[Plate, Picture]:
    """Return the plate of a clip, better known if it was found in its ``shot``, and its smoke's source radiance.

    Both clips are at the plate's exposure; ``smoky`` are the frames of `clip_source`.
    """
    source = clip_source(clip, plate, smoky)
    if plate.images is not None:
        return plate, source
    better, loss = plate_in_turn(shot, plate, source)
    if better is plate:
        return plate, source
    after = clip_source(clip, better, smoky)
    # a plate that holds bright smoke makes what it leaves look like dark smoke
    return better, source if loss <= _likeliest(*_shrunk(shot, plate), after)[1] else after


def plate_in_turn(clip: Clip, plate: Plate, source: Picture) -> tuple[Plate, float]:
    """Return a plate that is better known where its confidence is less than 1, and the mean loss of the first turn.

    ``clip`` is at the plate's exposure. ``source`` (3,) is the usual source radiance of its smoke.
    """
    if (1 - plate.confidence).mean() < MIN_UNKNOWN or not plate.errors.any():
        return plate, 0.0
    pictures, first, size = _shrunk(clip, plate)
    behind = area_average(first.image, *size)
    variance = float(np.trace(plate.errors)) / 3
    start, loss = _likeliest(pictures, first, size, source)
    found = replace(first, image=_changed(first, start - behind))
    for _ in range(TURNS):
        best, clearest = np.zeros_like(behind[..., :1]), start
        for picture in pictures:
            shown, weight = _shown(Cells.of(picture, found, size), source)
            # errors of smoke are much the same in all frames, so a mean of frames is no better than the best of them
            best, clearest = np.maximum(best, weight), np.where(weight > best, shown, clearest)
        left = 1 / (1 + variance * best)
        change = start + (1 - left) * (clearest - start) - behind
        found = replace(first, image=_changed(first, change))
    confidence = 1 - (1 - plate.confidence) * area_average(left[..., 0], *clip.size)
    return replace(plate, image=_changed(plate, change), confidence=confidence), loss


def _shrunk(clip: Clip, plate: Plate) -> tuple[list[Picture], Plate, tuple[int, int]]:
    """Some frames of a clip and its plate, some pixels to a cell, and the numbers of columns and rows of cells."""
    size = reduced_size(*clip.size, SIDE)
    finer = [min(round(FINER * cells), pixels) for cells, pixels in zip(size, clip.size, strict=True)]
    pixels = clip.size[0] * clip.size[1] / (finer[0] * finer[1])
    pictures = [clip.stored(frame).averaged(*finer) for frame in clip.spread(FRAMES)]
    return pictures, plate.through(lambda part: area_average(part, *finer), pixels), size


def _likeliest(
    pictures: Sequence[Picture], plate: Plate, size: tuple[int, int], source: Picture
) -> tuple[Picture, float]:
    """The plate by cell (rows, columns, 3) that best explains all frames as mixtures, beside its continuations.

    The other value is its mean loss. A frame's is that of the noise's Student t distribution at the likeliest T. The
    brightness of J varies by `BRIGHTNESS_RANGE`, and so does that of S = (1 - T) J. Where a frame is clear it is clear
    around there as well, so neighbors decide together.
    """
    frames = [Cells.of(picture, plate, size) for picture in pictures]
    start = frames[0].behind
    where = frames[0].unknown > MIN_UNKNOWN
    continued = _continuations(start, ~where)[:, where]
    seen = [(cells.seen[where].astype(np.float64), cells.noise[where].mean(-1, dtype=np.float64)) for cells in frames]
    light = np.asarray(source, np.float64)
    low, high = _range_of(plate)
    proposed = (np.clip((values - (1 - t) * light) / t, low, high) for values, _ in seen for t in CANDIDATES)
    nearby = blurred(where.astype(np.float32), NEIGHBORHOOD)[where]
    best, least = continued[0], np.full(continued.shape[1], np.inf)
    for each in (*continued, *proposed):
        loss = _prior_loss(each, continued, plate.errors, high - low)
        for values, noise in seen:
            misfits = [_misfit(values - t * each, (1 - t) * light, noise) for t in MIXTURES]
            loss += INDEPENDENT / FRAMES * np.min(misfits, axis=0)
        whole = np.zeros(where.shape, np.float32)
        whole[where] = loss
        loss = blurred(whole, NEIGHBORHOOD)[where] / nearby
        better = loss < least
        best, least = np.where(better[:, None], each, best), np.minimum(loss, least)
    found = start.copy()
    found[where] = best
    return found, float(least.mean())


def _continuations(plate: Picture, known: Mask) -> NDArray[np.float64]:
    """A plate (rows, columns, 3) as it is, and continued from the nearest cells that are ``known`` along its lines.

    Shape (3, rows, columns, 3): to all sides, up and down, to the left and right. Lines without known cells stay.
    """
    found = np.stack([plate] * 3).astype(np.float64)
    for lines, those in ((found[1].swapaxes(0, 1), known.T), (found[2], known)):
        for line, sure in zip(lines, those, strict=True):
            at = np.flatnonzero(sure)
            for channel in line.T if len(at) else ():
                channel[:] = np.interp(np.arange(len(channel)), at, channel[at])
    return found


def _prior_loss(plate: Picture, continued: NDArray[np.float64], errors: Picture, extent: Picture) -> Picture:
    """The loss (n,) of a plate (n, 3) by its continuations (continuations, n, 3), one of which is right but for errors.

    These are normal, of a covariance (3, 3). An `OBJECT` that no continuation shows has any color of an extent (3,).
    """
    covariance = errors + np.eye(3) * float(EIGHT_BIT_STEP) ** 2
    peak = -0.5 * np.linalg.slogdet(2 * np.pi * covariance)[1]
    away = plate - continued
    squares = np.einsum("kni,ij,knj->kn", away, np.linalg.inv(covariance), away)
    any_color = np.full((1, len(plate)), np.log(OBJECT) - np.log(np.maximum(extent, EIGHT_BIT_STEP)).sum() - peak)
    each = np.log((1 - OBJECT) / len(continued)) - 0.5 * squares
    return np.asarray(-np.logaddexp.reduce(np.concatenate([each, any_color]), axis=0))


def _misfit(left: Picture, sent: Picture, noise: Picture) -> Picture:
    """The loss (n,) of cells of which T B leaves ``left`` (n, 3) for S, whose mean is ``sent`` (3,)."""
    apart, spread = left - sent, np.square(BRIGHTNESS_RANGE)
    along = spread * np.square(apart @ sent) / (noise + spread * (sent @ sent))
    squares = (np.square(apart).sum(-1) - along) / noise
    return np.asarray(0.5 * (OUTLIER_FREEDOM + 3) * np.log1p(squares / OUTLIER_FREEDOM))


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
    return np.where(unknown > 0, np.clip(changed, *_range_of(plate)), changed)


def _range_of(plate: Plate) -> tuple[Picture, Picture]:
    """The least and the largest color (3,) that is known of a plate, but for outliers."""
    known = plate.image[plate.confidence == 1]
    if not len(known):
        return np.zeros(3, np.float32), np.full(3, np.inf, np.float32)
    low, high = np.quantile(known, RANGE, axis=0).astype(np.float32)
    return low, high
