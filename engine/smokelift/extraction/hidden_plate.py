"""The plate where smoke hides it in every frame, in turn with the smoke: B from I - S and T, these from B.

A plate that was found in a clip is continued from its surroundings where no frame is clear. But smoke lets through some
of what is there, in each frame another part. The turns start from the plate that explains all frames best: in each of
them it has to be a mixture of smoke and plate, S = (1 - T) J, whatever T, and it goes on from what is known around it,
above and below it, or on its sides, unless it is an object there. Its detail is that of one of the frames, and what
smoke leaves of it in the others has to be T times as strong. Then what an element leaves of a picture,
(I - S) / T, is the plate's; the clearest frame says it best. Smoke that stands from the first frame to the last shows
next to nothing, and what is behind it stays as it was. A person or an animal may have been elsewhere in other frames
than those in use: before and after them each cell of the plate may change once. J is first what brightens the plate
most, or what is found before the plate as it is, whichever makes the frames likelier. It is found again from the plate
that the turns end with, and the plate with it, as long as the frames become likelier still.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Mask
from smokelift.extraction.element import (
    BRIGHTNESS_RANGE,
    MAX_CELLS,
    MIN_VARIANCE,
    OUTLIER_FREEDOM,
    SOURCE_SIDE,
    Cells,
    compared_size,
    extracted,
    first_source,
    source_in,
    source_of,
)
from smokelift.extraction.find_background import OBJECT
from smokelift.extraction.plate import Plate, resized
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, blurred, reduced_size
from smokelift.footage.noise import EIGHT_BIT_STEP

FRAMES, SIDE, TURNS = 8, 96, 4
"""Frames that are extracted, cells along their longer side, and turns. More frames and turns change T rms by .001,
twice the cells by .004 and .01, for four times the time (docs/experiments/hidden-plate.md)."""

SOURCE_FRAMES = 4
"""Frames from which the source radiance is found."""

SOURCES, MAX_LOSS_RATIO = 6, 0.99
"""Most J that are found in turn, each from the plate of the one before, and the loss of the next over the one before
at which it is worth its turns (docs/experiments/hidden-plate.md)."""

RANGE = 0.005, 0.995
"""Quantiles of each channel of what is known of a plate, between which the rest of it is."""

MIXTURES = np.linspace(0, 1, 6)
"""Values of T among which a cell's mixture of smoke and plate is searched."""

CANDIDATES = 1.0, 0.6, 0.36
"""Values of T for which each frame proposes a plate."""

NEIGHBORHOOD = 2.0
"""Standard deviation, in cells, of the Gaussian over which neighbors decide together, and that detail is finer than: T
of elements of eleven composed clips is off by .164, .159 and .158 with 1, 2 and 4, and by .162 cell by cell
(docs/experiments/hidden-plate.md)."""

DETAIL_WEIGHT = 0.2
"""Weight of what detail leaves unexplained, beside colors of cells: T of elements of five composed clips is off by
.185, .176 and .190 with 0, .2 and 1 (docs/experiments/hidden-plate.md)."""

ERRORS_LAST = 0.5625
"""Seconds after which a frame's errors of smoke are others: they last (.75 to .95 from a frame to the next), and eight
frames of 28, of 1/24 s, count as three (docs/experiments/hidden-plate.md)."""

CHANGES = 0.01
"""Changes of a cell of the plate per second. More often smoke that came lately is taken for a plate that changed: steam
of a pan with .03 and .1, a puff with 1 (docs/experiments/hidden-plate.md)."""

MIN_UNKNOWN = 0.01
"""Smallest fraction of a plate that has to be unknown for turns to change the smoke."""

CLEAR_TRANSMITTANCE = 0.02
"""Lower bound of T, for division."""


def plate_and_source(clip: Clip, uncut: Clip, plate: Plate, smoky: Sequence[int]) -> tuple[Plate, Picture]:
    """Return the plate of a clip, better known if it was found in its file, and its smoke's source radiance.

    ``uncut`` is all of that file between two cuts. Both clips are at the plate's exposure; ``smoky`` are frames of the
    clip, those with the most smoke first.
    """
    most = sorted(smoky[:SOURCE_FRAMES])
    thickest = SomeFrames.of(clip, plate, most, np.zeros(len(most)), SOURCE_SIDE, MAX_CELLS)
    seen = thickest.against(thickest.plate)
    if plate.images is not None or is_known(plate):
        return plate, source_in(seen)
    frames = SomeFrames.of(uncut, plate, *_frames_about(clip, uncut), SIDE)
    starts = [likeliest_plate(frames, source) for source in (first_source(seen), source_in(seen))]
    turned = in_turn(frames, min(starts, key=lambda start: start.loss))
    for _ in range(SOURCES):
        start = likeliest_plate(frames, source_in(thickest.against(frames.with_plate(thickest.plate, turned))))
        if start.loss > MAX_LOSS_RATIO * turned.loss:
            break
        turned = in_turn(frames, start)
    return frames.with_plate(plate, turned), turned.source


def _frames_about(clip: Clip, uncut: Clip) -> tuple[list[int], NDArray[np.float64]]:
    """Frames spread over a file, one of the clip at least, and their seconds after it: negative before, 0 in it."""
    spread = np.array(uncut.spread(FRAMES))
    first, last = clip.numbers[0] - uncut.numbers[0], clip.numbers[-1] - uncut.numbers[0]
    away = spread - np.clip(spread, first, last)
    if away.all():
        nearest = np.abs(away).argmin()
        spread[nearest], away[nearest] = (first + last) // 2, 0
    return spread.tolist(), away / uncut.fps


def is_known(plate: Plate) -> bool:
    """Whether a plate is known all over, or nothing is known of its errors: turns do not change it."""
    return bool((1 - plate.confidence).mean() < MIN_UNKNOWN or not plate.errors.any())


@dataclass(frozen=True, eq=False)
class HiddenPlate:
    """The likeliest plate by cell (rows, columns, 3) before smoke of a source radiance (3,), and its mean loss.

    ``detail`` has a factor (rows, columns) for each frame: 1 / T where the plate has its detail, seen through smoke.
    ``left`` (rows, columns, 1) is the part that turns leave unknown: 1 before them.
    """

    image: Picture
    source: Picture
    loss: float
    detail: list[Picture]
    left: Picture


@dataclass(frozen=True, eq=False)
class SomeFrames:
    """Some frames of a clip and its plate, of some pixels to a cell.

    ``seconds_after`` (frames,) are from the part of the clip in use, negative before it, 0 in it; ``cells`` are the
    numbers of columns and rows of cells.
    """

    clip: Clip
    numbers: Sequence[int]
    seconds_after: NDArray[np.float64]
    pictures: Sequence[Picture]
    plate: Plate
    cells: tuple[int, int]

    @staticmethod
    def of(
        clip: Clip,
        plate: Plate,
        numbers: Sequence[int],
        seconds_after: NDArray[np.float64],
        side: int,
        detail_of: int = 0,
    ) -> "SomeFrames":
        """Read frames at their plate's exposure, for so many cells along the longer ``side``; see `compared_size`."""
        cells = reduced_size(*clip.size, side)
        size = compared_size(cells, clip.size, plate.finest, detail_of)
        pictures = [clip.stored(frame).averaged(*size) for frame in numbers]
        return SomeFrames(clip, numbers, seconds_after, pictures, resized(plate, size), cells)

    @property
    def independent(self) -> float:
        """How many independent frames each of them counts as."""
        seconds = (self.numbers[-1] - self.numbers[0]) / self.clip.fps
        return min(1.0, (1 + seconds / ERRORS_LAST) / len(self.numbers))

    def against(self, plate: Plate) -> list[Cells]:
        """Return the cells of the frames against a plate of their size."""
        shown = zip(self.numbers, self.pictures, strict=True)
        return [Cells.of(picture, plate.at(number), self.cells) for number, picture in shown]

    def with_plate(self, plate: Plate, found: HiddenPlate) -> Plate:
        """Return a plate of any size as it is after the turns: better known where its confidence is less than 1."""
        size = plate.image.shape[1], plate.image.shape[0]
        plate = _with_detail(plate, found.detail, lambda each: self.clip.stored(self.numbers[each]).averaged(*size))
        confidence = 1 - (1 - plate.confidence) * area_average(found.left[..., 0], *size)
        return replace(plate, image=_changed(plate, found.image - self.detailed(found)[1]), confidence=confidence)

    def detailed(self, found: HiddenPlate) -> tuple[Plate, Picture]:
        """Return the plate with the detail of what is ``found``, and that by cell, which the latter changes."""
        plate = _with_detail(self.plate, found.detail, self.pictures.__getitem__)
        return plate, area_average(plate.image, *self.cells)


def in_turn(frames: SomeFrames, start: HiddenPlate) -> HiddenPlate:
    """Change a plate and extract the smoke before it in turn."""
    variance, turned = float(np.trace(frames.plate.errors)) / 3, start
    plate, behind = frames.detailed(start)
    for _ in range(TURNS):
        found = replace(plate, image=_changed(plate, turned.image - behind))
        best, clearest = np.zeros_like(start.left), start.image
        for cells, seconds in zip(frames.against(found), frames.seconds_after, strict=True):
            shown, weight = _shown(cells, start.source)
            weight *= np.exp(-CHANGES * abs(seconds))
            # errors of smoke are much the same in all frames, so a mean of frames is no better than the best of them
            best, clearest = np.maximum(best, weight), np.where(weight > best, shown, clearest)
        left = 1 / (1 + variance * best)
        turned = replace(start, image=start.image + (1 - left) * (clearest - start.image), left=left)
    return turned


class _Hypothesis(NamedTuple):
    """A plate's colors (n, 3), and without detail; the frame, if any, that has its detail, and T of smoke before it."""

    color: NDArray[np.floating[Any]]
    smooth: NDArray[np.floating[Any]]
    frame: int = -1
    clear: float = 1.0


def likeliest_plate(frames: SomeFrames, source: Picture) -> HiddenPlate:
    """Return the plate that best explains all frames as mixtures with smoke of a source radiance (3,).

    A frame's loss is that of the noise's Student t distribution at the likeliest T. The brightness of J varies by
    `BRIGHTNESS_RANGE`, and so does that of S = (1 - T) J; neither has detail. Where a frame is clear it is clear around
    there as well, so neighbors decide together.
    """
    pictures, plate, size = frames.pictures, frames.plate, frames.cells
    shown = frames.against(plate)
    start = shown[0].behind
    where = shown[0].unknown > MIN_UNKNOWN
    continued = _continuations(start, ~where)
    expected = continued[:, where]
    low, high = _range_of(plate)
    seen = [(cells.seen[where].astype(np.float64), cells.noise[where].mean(-1, dtype=np.float64)) for cells in shown]
    nearby = blurred(where.astype(np.float32), NEIGHBORHOOD)[where]

    def around(values: Picture) -> Picture:
        """The means (n,) of the cells' values over their neighborhoods."""
        whole = np.zeros(where.shape, np.float32)
        whole[where] = values
        return blurred(whole, NEIGHBORHOOD)[where] / nearby

    # the plate's own comes last, as that of frame -1
    details = [_detail(picture, size) for picture in (*pictures, plate.image)]
    products = [[around(area_average((a * b).mean(-1), *size)[where]) for b in details] for a in details]
    coarse = [area_average(detail, *size)[where] for detail in details]
    hypotheses = _hypotheses([values for values, _ in seen], coarse, continued, where, source, (low, high))
    # no detail is likely that is stronger than that of the known plate
    known = np.maximum(1 - shown[0].unknown, MIN_VARIANCE)
    usual = np.average(area_average(np.square(details[-1]).mean(-1), *size), weights=known) + MIN_VARIANCE
    best, least = np.zeros(len(nearby), np.int64), np.full(len(nearby), np.inf)
    away = [values - source for values, _ in seen]
    spread = np.square(BRIGHTNESS_RANGE)
    # colors are normal with one variance v in all channels: each has a loss of (ln(2 pi v) + square / v) / 2
    channels = source.size
    # another plate has any color, and explains no frame better than this one could
    any_color = np.log(np.maximum(high - low, EIGHT_BIT_STEP)).sum()
    usual_noise = np.mean([noise for _, noise in seen], axis=0)
    loss_of_another = np.maximum(any_color - channels / 2 * np.log(2 * np.pi * usual_noise), 0)
    losses = np.zeros((len(seen), len(nearby)))
    for index, (color, smooth, number, clear) in enumerate(hypotheses):
        loss = _prior_loss(smooth, expected, plate.errors, high - low)
        loss += channels / 2 * DETAIL_WEIGHT * products[number][number] / (clear**2 * usual)
        behind = color - source
        for frame, (_, noise) in enumerate(seen):
            squares = np.full(len(nearby), np.inf)
            # I - (1 - T) J - T B = (I - J) - T (B - J), whose square and whose part along S are polynomials of T
            pairs = (away[frame],) * 2, (away[frame], behind), (behind,) * 2
            terms = [np.einsum("nc,nc->n", *pair) for pair in pairs]
            along = away[frame] @ source, behind @ source
            for t in MIXTURES:
                sent = (1 - t) * (along[0] - t * along[1])
                misfit = terms[0] - 2 * t * terms[1] + t**2 * terms[2]
                misfit -= spread * np.square(sent) / (noise + spread * (1 - t) ** 2 * (source @ source))
                left = t / clear
                detail = products[frame][frame] - 2 * left * products[number][frame]
                detail += left**2 * products[number][number]
                squares = np.minimum(squares, misfit + channels * DETAIL_WEIGHT * detail)
            losses[frame] = (OUTLIER_FREEDOM + channels) / 2 * np.log1p(squares / noise / OUTLIER_FREEDOM)
        loss += _over_time(frames.independent * losses, frames.seconds_after, loss_of_another)
        loss = around(loss)
        best, least = np.where(loss < least, index, best), np.minimum(loss, least)
    image, factors = start.copy(), np.zeros((len(pictures), *where.shape), np.float32)
    for index, hypothesis in enumerate(hypotheses):
        taken = where.copy()
        taken[where] = best == index
        image[taken] = hypothesis.color[best == index]
        if hypothesis.frame >= 0:
            factors[hypothesis.frame][taken] = 1 / hypothesis.clear
    return HiddenPlate(image, source, float(least.mean()), list(factors), np.ones_like(image[..., :1]))


def _over_time(
    losses: NDArray[np.float64], seconds_after: NDArray[np.float64], loss_of_another: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The loss (n,) of a plate by its ``losses`` (frames, n) in frames so many seconds after the clip in use.

    Before and after the clip it may have changed once: frames beyond tell nothing of it, at the loss of another plate.
    """
    total: NDArray[np.float64] = losses[seconds_after == 0].sum(0)
    for side in (np.flatnonzero(seconds_after < 0), np.flatnonzero(seconds_after > 0)[::-1]):  # the farthest first
        loss = np.zeros_like(total)
        for frame, seconds in zip(side, -np.diff(np.abs(seconds_after[side]), append=0), strict=True):
            changed = loss_of_another - np.log(-np.expm1(-CHANGES * seconds))
            loss = np.minimum(loss + losses[frame] + CHANGES * seconds, changed)
        total += loss
    return total


def _hypotheses(
    seen: Sequence[NDArray[np.float64]],
    details: Sequence[Picture],
    continued: NDArray[np.float64],
    where: Mask,
    source: Picture,
    extent: tuple[Picture, Picture],
) -> list[_Hypothesis]:
    """Plates that are continued, that frames show through smoke, and that are continued with the detail of a frame.

    ``seen`` and ``details`` are the colors (n, 3) of the cells ``where`` a plate is not known, and of their detail.
    """
    hypotheses = [_Hypothesis(color, color) for color in continued[:, where]]
    evened = [blurred(each.astype(np.float32), NEIGHBORHOOD)[where] for each in continued]
    for frame, values in enumerate(seen):
        for t in CANDIDATES:
            own = np.clip((values - (1 - t) * source) / t, *extent)
            hypotheses.append(_Hypothesis(own, own, frame, t))
            hypotheses += [_Hypothesis(np.clip(each + details[frame] / t, *extent), each, frame, t) for each in evened]
    return hypotheses


def _detail(picture: Picture, cells: tuple[int, ...]) -> Picture:
    """What of a picture (rows, columns, 3) is finer than the neighborhoods of its cells."""
    return picture - blurred(picture, NEIGHBORHOOD * max(picture.shape[:2]) / max(cells))


def _with_detail(plate: Plate, factors: Sequence[Picture], picture: Callable[[int], Picture]) -> Plate:
    """A plate that has the detail of frames, times their factors (rows, columns), where it is not known."""
    rows, columns = plate.confidence.shape
    unknown = (1 - plate.confidence)[..., None]
    image, own = plate.image.copy(), _detail(plate.image, factors[0].shape)
    for frame, factor in enumerate(factors):
        if factor.any():
            taken, times = (area_average(each, columns, rows)[..., None] for each in ((factor > 0) * 1.0, factor))
            image += unknown * (times * _detail(picture(frame), factor.shape) - taken * own)
    return replace(plate, image=np.maximum(image, 0))


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
