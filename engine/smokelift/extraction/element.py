"""The smoke of one picture without what is behind it: I = S + T B + n, maximum a posteriori.

S is the radiance that smoke sends, T its transmittance, B the clean plate. Smoke varies slowly over a picture, a wall
does not. So where B has detail, how much of it is left shows T, whatever the light; where B is flat, its color and
brightness do. S = (1 - T) J, with the source radiance J of smoke in a light: its brightness varies by shadows, its
color hardly. The opacity 1 - T and ln J are sums over the levels of a pyramid, whose coefficients are independent
(`cpp/extraction.cpp` solves for them). What does not fit, such as a hand before the smoke, counts less: it is an
outlier of the noise. Figures: docs/experiments/extraction.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import smokelift._core as _core
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate, noise_at, resized
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import OPAQUE
from smokelift.footage.images import Picture, area_average, blurred, channel_mean, linear_to_srgb, reduced_size
from smokelift.footage.noise import EIGHT_BIT_STEP, linear_per_srgb

FULL_SCALE = 0.12
"""Distance, over the longer side of the picture, at which smoke's opacity has its whole range."""

ROUGHNESS = 0.85
"""Exponent of the distance by which differences of opacity and of ln J grow: the Hurst exponent of turbulence seen
through its depth, (11/3 - 2) / 2 = .83 by Kolmogorov's spectrum, and .8 to .95 in eight baked scenes
(docs/experiments/extraction.md)."""

OPACITY_RANGE, BRIGHTNESS_RANGE = 0.5, 0.5
"""Standard deviations of the opacity and of the brightness of ln J over that distance."""

BRIGHTNESS_SCALE = 2.25
"""Distance over which the brightness has its range, in those of the opacity: shadows are wider than wisps."""

CHROMA = 0.005
"""Variation of the chroma of ln J over that of its brightness: light of one color (docs/experiments/extraction.md)."""

MEAN_OPACITY, MEAN_BRIGHTNESS = 1.0, 1.0
"""Standard deviations of the means of the opacity and of ln J over the picture: neither is known."""

MODEL_ERROR = 0.05
"""Standard deviation of what no T and J that are even over a cell explain, over the mean radiance of the plate
and what the smoke changes in the picture."""

OUTLIER_FREEDOM = 5.0
"""Degrees of freedom of the noise's Student t distribution: outliers of more than three deviations hardly count."""

ROUNDS, ITERATIONS = 6, 40
"""Linearizations of ln J, and steps of conjugate gradients for each: twice as many of both change T by .003
(measured)."""

SOURCE_ROUNDS = 6
"""Times that the usual source radiance is found from the smoke, and that from it: six leave T rms within .01 of what
nine do (measured on 36 composed clips in white, warm and cold light)."""

MIN_CHROMA = 0.01
"""Lower bound of a channel of the usual source radiance over its mean, for logarithms."""

START_PERCENTILE = 90
"""Percentile, of what changes its plate to one side, that is taken for J: what is farther may be no smoke."""

START_HUE = 0.4
"""Smallest hue, as of `HUE`, of what the search starts from that is not taken for gray: in 40 composed clips of gray
smoke before leaves, walls and skies it is .27 at most, at night in the light of lamps .55 (measured)."""

BRIGHT_PERCENTILE, MIN_SOURCE = 99, 0.01
"""Percentile of a picture's brightness that it starts from where smoke only darkens, and its lower bound, linear: a
picture darker than that shows no light in eight bits."""

FINER = 1.5
"""Pixels along a cell whose detail is compared, but for what is finer than a codec keeps of it: `Plate.finest`
(docs/experiments/extraction.md)."""

WINDOW_BLUR = 2.0
"""Standard deviation, in cells, of the Gaussian that smooths the deviation of T, which is found in windows of four."""

MIN_VARIANCE = 1e-12
"""Lower bound of the noise's variance (radiance squared), for division."""

MAX_CELLS = 192
"""Cells along the longer side: T and J have no finer detail that a plate could show."""

SOURCE_SIDE = 64
"""Cells along the longer side of pictures from which the source radiance is found."""

HUE = 2 * MODEL_ERROR
"""Smallest difference of two colors over their brightness, root mean square, from which on they differ: both may be
off by the model's error. Skies differ from white by .2 to .3, a gray wall by .01."""

SOURCE_FACTOR = 2.0
"""Standard deviation, as a factor, of a source radiance that is found before a smooth plate: `extract_element` asks for
no better one."""

CHROMA_BASIS = np.array([[1.5**0.5, 0.5**0.5], [0, -(2**0.5)], [-(1.5**0.5), 0.5**0.5]], np.float32)
"""Two components of chroma by channel, as in `cpp/extraction.cpp` (by definition)."""


@dataclass(frozen=True, eq=False)
class Element:
    """What smoke sends and lets through, and how certainly that is known.

    Attributes
    ----------
    radiance : (rows, columns, 3)
        S, linear, premultiplied by the opacity 1 - T.
    transmittance : (rows, columns)
        T, from 0 to 1.
    deviation : (rows, columns)
        Standard deviation of T at a fixed S + T B, which is known within the plate's noise.
    shared : (rows, columns)
        That of T in clear air by noise that many pixels share: a mean over them keeps all of it.
    weight : (rows, columns)
        Weight of the picture, from 0 to 1: little for what is neither smoke nor its plate.
    """

    radiance: Picture
    transmittance: Picture
    deviation: Picture
    shared: Picture
    weight: Picture

    def over(self, color: Picture) -> Picture:
        """Return the element over a color (3,) or a picture (rows, columns, 3)."""
        return self.radiance + self.transmittance[..., None] * color

    def rgba(self) -> Picture:
        """Return the element as premultiplied linear RGBA (rows, columns, 4)."""
        return np.dstack([np.maximum(self.radiance, 0), 1 - self.transmittance])


def extract_element(picture: Picture, plate: Plate, source: Picture, size: tuple[int, int]) -> Element:
    """Extract the smoke of a linear picture (rows, columns, 3) before its plate.

    ``source`` (3,) is the usual J of the clip's smoke, within a factor of two. The element has a ``size`` (columns,
    rows), at most the picture's; its pixels are means.
    """
    columns, rows = size
    cells = Cells.compared(picture, plate, reduced_size(columns, rows, MAX_CELLS))
    fields, deviation, weight = extracted(cells, source)
    deviation = blurred(deviation, WINDOW_BLUR)
    lasting = plate.noise.shared * linear_per_srgb(linear_to_srgb(cells.seen))
    shared = deviation * np.sqrt(np.square(lasting).mean(-1) / cells.noise.mean(-1))
    small, behind = (area_average(each, columns, rows) for each in (picture, plate.image))
    fields, deviation, shared, weight = (
        area_average(each, columns, rows) for each in (fields, deviation, shared, weight)
    )
    clear = 1 - fields[..., 0]
    smooth = fields[..., :1] * source_of(fields, source)
    passed = clear[..., None] * behind
    # what is finer than the cells is the smoke's own as far as its light varies, the rest noise and the plate's
    own = np.square(BRIGHTNESS_RANGE * smooth).mean(-1)
    noise = np.square(noise_at(small, plate)).mean(-1) * (columns * rows / plate.confidence.size)
    noise += np.square(MODEL_ERROR * passed).mean(-1)
    fine_weight = np.asarray(weight * own / np.maximum(own + noise, MIN_VARIANCE), np.float32)
    return Element(smooth + fine_weight[..., None] * (small - passed - smooth), clear, deviation, shared, weight)


def clip_element(
    clip: Clip,
    frame: int,
    plate: Plate,
    source: Picture,
    size: tuple[int, int],
    part: Callable[[NDArray[Any]], NDArray[Any]] | None = None,
) -> Element:
    """Return the smoke of a ``part`` of a clip's frame, by default all of it: what alpha says, or else extracted.

    ``plate`` is that of the clip; ``source`` and ``size`` are those of `extract_element`.
    """
    picture, plate, alpha = clip.stored(frame), plate.at(frame), clip.alpha(frame)
    if part is not None:
        picture, plate, alpha = picture.cut(part), plate.through(part), None if alpha is None else part(alpha)
    if alpha is None:
        return extract_element(picture.linear(), plate, source, size)
    seen, behind, opacity = (area_average(each, *size) for each in (picture.linear(), plate.image, alpha))
    sent = np.maximum(seen - (1 - opacity)[..., None] * behind, 0)
    none, rounded = np.zeros_like(opacity), np.full_like(opacity, EIGHT_BIT_STEP)
    return Element(sent, 1 - opacity, rounded, none, np.ones_like(opacity))


def alpha_source(clip: Clip, plate: Plate, frames: Sequence[int], side: int) -> Picture | None:
    """Return the usual J (3,) of the smoke in some frames of a clip with alpha: S over 1 - T.

    None if alpha covers nothing, as of fire that is added, or if most of what it covers is opaque. Then alpha may be a
    mask around smoke and what is behind it, and no more of opaque smoke is known than its picture shows. Pictures are
    reduced to ``side`` pixels along the longer side.
    """
    size = reduced_size(*clip.size, side)
    elements = [clip_element(clip, frame, plate, np.ones(3, np.float32), size) for frame in frames]
    opacity = 1 - np.stack([element.transmittance for element in elements])
    covered = (opacity > 1 - OPAQUE).sum()
    if covered == 0 or (opacity >= OPAQUE).sum() > 0.5 * covered:
        return None
    sent = np.sum([element.radiance.sum((0, 1)) for element in elements], axis=0)
    return np.asarray(np.maximum(sent / opacity.sum(), MIN_SOURCE), np.float32)


def evenly_lit_element(picture: Picture, plate: Plate, source: Picture) -> Element:
    """Return the smoke of a linear picture (rows, columns, 3) before a plate that does not show its transmittance.

    Any T explains such a picture. By convention it is that of smoke which sends ``source`` (3,) wherever it is opaque,
    unless S would be negative with it. T is 1 where no smoke is seen.
    """
    seen = matte(picture, plate).probability[..., None] * (picture - plate.image)
    contrast = source - plate.image
    opacity = np.sum(seen * contrast, -1) / np.maximum(np.sum(contrast * contrast, -1), MIN_VARIANCE)
    darkened = np.max(-seen / np.maximum(plate.image, MIN_VARIANCE), -1)
    opacity = np.clip(np.maximum(opacity, darkened), 0, 1).astype(np.float32)
    none, all_of_it = np.zeros_like(opacity), np.ones_like(opacity)
    radiance = np.maximum(seen + opacity[..., None] * plate.image, 0)
    return Element(radiance, 1 - opacity, all_of_it, none, all_of_it)


def source_of(fields: Picture, source: Picture) -> Picture:
    """Return J (rows, columns, 3) from the fields of an extraction about a ``source`` (3,)."""
    brightness = 2 / (1 + np.exp(-2 * fields[..., 1:2]))
    return np.asarray(source * brightness * np.exp(fields[..., 2:] @ CHROMA_BASIS.T), np.float32)


def usual_source(pictures: Sequence[tuple[Picture, Plate]], size: tuple[int, int]) -> Picture:
    """Return the usual J (3,) of a clip's smoke from some of its pictures: S over opacity, by least squares.

    The pictures are reduced to a ``size`` (columns, rows).
    """
    return source_in([Cells.compared(picture, plate, size, MAX_CELLS) for picture, plate in pictures])


def compared_size(cells: tuple[int, int], whole: tuple[int, int], finest: float, detail_of: int = 0) -> tuple[int, int]:
    """Return the numbers of columns and rows of the pixels whose detail cells of a ``whole`` picture compare.

    Fewer cells than ``detail_of`` along the longer side are compared in as many pixels as that number would be.
    """
    finer = FINER * max(1.0, detail_of / max(cells))
    most = (max(1, round(count / finest)) for count in whole)
    columns, rows = (min(round(finer * count), of) for count, of in zip(cells, most, strict=True))
    return columns, rows


def first_source(seen: Sequence[Cells], side: int = 1) -> Picture:
    """Return the J (3,) that the search starts from: that of what brightens the plates most, or darkens (-1) them.

    It is gray unless its hue is far from that: half of it may be what is behind the smoke. If nothing changes the
    plates to that side beyond the noise of a pixel, it is gray and as bright as the brightest pixels.
    """
    changed = []
    for cells in seen:
        variance = cells.noise.mean(-1) + cells.unknown * np.trace(cells.errors) / 3
        changed.append(cells.seen[side * channel_mean(cells.seen - cells.behind) > 3 * np.sqrt(variance)])
    if any(map(len, changed)):
        first = side * np.percentile(side * np.concatenate(changed), START_PERCENTILE, axis=0)
    else:
        first = np.full(3, np.mean([np.percentile(channel_mean(cells.seen), BRIGHT_PERCENTILE) for cells in seen]))
    gray = np.full(3, first.mean())
    found = first if _strength(first - gray) > START_HUE * gray[0] else gray
    return np.asarray(np.maximum(found, MIN_SOURCE), np.float32)


def source_in(seen: Sequence[Cells]) -> Picture:
    """Return the usual J (3,) of the smoke in cells.

    Before a plate with little detail, dark smoke that is opaque in places looks like black smoke that is thin. Where
    the search ends in black, J is that of what darkens the plates most.
    """
    source = first_source(seen)
    for _ in range(SOURCE_ROUNDS):
        total, behind, squares = np.zeros(3), np.zeros(3), 0.0
        for cells in seen:
            fields, _, weight = extracted(cells, source)
            opacity = fields[..., 0].astype(np.float64)
            sent = cells.seen - (1 - opacity)[..., None] * cells.behind
            # errors of the plate are errors of S as far as smoke lets them through
            noise, errors = cells.noise.mean(-1), cells.unknown * (np.trace(cells.errors) / 3)
            weight = weight * noise / (noise + (1 - opacity) ** 2 * errors)
            total += np.sum((weight * opacity)[..., None] * sent, axis=(0, 1))
            behind += np.sum((weight * opacity**2)[..., None] * cells.behind, axis=(0, 1))
            squares += float(np.sum(weight * opacity**2))
        found = np.maximum(total / max(squares, 1e-12), 0)
        brightness = max(float(found.mean()), MIN_SOURCE)
        source = np.asarray(np.maximum(found, MIN_CHROMA * brightness), np.float32)
    if found.mean() < MIN_SOURCE:
        return first_source(seen, -1)
    if any(_has_detail(cells.behind) for cells in seen):
        return source
    return _nearest_to_white(source, behind / max(squares, 1e-12))


def _nearest_to_white(source: Picture, behind: Picture) -> Picture:
    """The likeliest source radiance (3,) on the line of colors from what is ``behind`` (3,) through one that was found.

    Before a smooth plate thinner smoke of a color farther along that line looks the same. Light is mostly white: its
    hue has a Cauchy distribution of width `HUE`, whose tails leave colored smoke as it is. The distance along the line
    has a log-normal one of width `SOURCE_FACTOR`.
    """
    times = np.geomspace(1 / SOURCE_FACTOR, SOURCE_FACTOR, 65)
    line = behind + times[:, None] * (source - behind)
    brightness = line.mean(-1)
    hue = np.sqrt(np.square(line - brightness[:, None]).mean(-1)) / np.maximum(brightness, MIN_SOURCE)
    cost = np.log1p(np.square(hue / HUE)) + np.square(np.log(times) / np.log(SOURCE_FACTOR))
    cost[(line < MIN_CHROMA * brightness[:, None]).any(-1)] = np.inf
    return np.asarray(line[cost.argmin()], np.float32)


def shows_transmittance(plate: Picture, source: Picture) -> bool:
    """Whether a plate (rows, columns, 3) shows how much of it smoke of a source radiance (3,) lets through.

    It has to have detail, or another hue than the smoke: before a smooth gray wall white smoke that is thick and white
    smoke that is thin look alike, and the picture itself is the best that can be fitted.
    """
    brightness = channel_mean(plate)
    own_hue = plate - brightness[..., None] * (source / max(float(source.mean()), 1e-12))
    return _has_detail(plate) or _strength(own_hue) > HUE * _strength(brightness)


def _has_detail(plate: Picture) -> bool:
    """Whether neighboring cells of a plate (rows, columns, 3) differ by more than the model's errors do.

    Those of six walls and photographs differ by .10 to .35 of their mean, of smooth skies by .001 and .03.
    """
    rows, columns = plate.shape[:2]
    small = area_average(plate, *reduced_size(columns, rows, SOURCE_SIDE))
    return _strength(small - blurred(small, 1.0)) > MODEL_ERROR * float(small.mean())


def _strength(values: Picture) -> float:
    """The root mean square."""
    return float(np.sqrt(np.square(values).mean()))


def extracted(cells: Cells, source: Picture) -> tuple[Picture, Picture, Picture]:
    """Return opacity and fields of J, deviation of T and weight of the data by cell; see `_core.extract`."""
    rows, columns = cells.moments.shape[:2]
    prior = cells.errors[np.triu_indices(3)].tolist(), scale_deviations((columns, rows)), OUTLIER_FREEDOM
    return _core.extract(cells.moments, source.tolist(), *prior, cells.pixels, ROUNDS, ITERATIONS)


def scale_deviations(cells: tuple[int, int]) -> list[tuple[float, float, float, float]]:
    """Return the prior's standard deviations by level: opacity, brightness and twice chroma of ln J."""
    longer = max(cells)
    levels = []
    for level in range(_core.pyramid_levels(cells[1], cells[0])):
        distance = 2.0**level / longer / FULL_SCALE
        opacity = OPACITY_RANGE * min(distance, 1.0) ** ROUGHNESS
        brightness = BRIGHTNESS_RANGE * min(distance / BRIGHTNESS_SCALE, 1.0) ** ROUGHNESS
        levels.append((opacity, brightness, CHROMA * brightness, CHROMA * brightness))
    chroma = CHROMA * BRIGHTNESS_RANGE
    levels[-1] = MEAN_OPACITY, MEAN_BRIGHTNESS, chroma, chroma
    return levels


@dataclass(frozen=True, eq=False)
class Cells:
    """A picture in cells of so many ``pixels``: their mean, the plate's, and what `_core.extract` takes."""

    seen: Picture
    behind: Picture
    moments: Picture
    errors: Picture
    pixels: float

    @property
    def noise(self) -> Picture:
        """Variance (rows, columns, 3) of a pixel of the picture."""
        return self.moments[..., 21:24]

    @property
    def unknown(self) -> Picture:
        """How much of the plate is not known, (rows, columns)."""
        return self.moments[..., 24]

    @staticmethod
    def compared(picture: Picture, plate: Plate, size: tuple[int, int], detail_of: int = 0) -> Cells:
        """Average a whole picture and its plate down to what is compared, see `compared_size`, and to cells."""
        rows, columns = picture.shape[:2]
        compared = compared_size(size, (columns, rows), plate.finest, detail_of)
        return Cells.of(area_average(picture, *compared), resized(plate, compared), size)

    @staticmethod
    def of(picture: Picture, plate: Plate, size: tuple[int, int]) -> Cells:
        """Average a picture and its plate, whose pixels are compared, down to a size (columns, rows)."""
        columns, rows = size
        change = picture - plate.image
        one, other = np.triu_indices(3)
        pairs = plate.image[..., one] * plate.image[..., other]
        products = (change[..., :, None] * plate.image[..., None, :]).reshape(*change.shape[:2], 9)
        means = area_average(np.dstack([plate.image, pairs, change, products, 1 - plate.confidence]), columns, rows)
        seen = means[..., :3] + means[..., 9:12]
        model = np.abs(means[..., 9:12]).mean(-1, keepdims=True) + float(plate.image.mean())
        noise = np.maximum(np.square(noise_at(seen, plate)) + np.square(MODEL_ERROR * model), MIN_VARIANCE)
        moments = np.dstack([means[..., :21], noise, means[..., 21:]])
        return Cells(seen, means[..., :3], moments, plate.errors, plate.confidence.size / (columns * rows))
