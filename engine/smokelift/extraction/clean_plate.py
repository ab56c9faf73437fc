"""The picture behind moving smoke: which frames show each pixel clear, and what is there where none does.

A pixel is clear, and has one value within the noise, or it is smoke, and has any. Two facts tell them apart:

- A clear pixel stays; smoke goes on. How often two successive frames of smoke are alike by chance is measured on the
  pixel. If smoke would keep a value for so many pairs of frames with a probability below `FALSE_ALARM` only, that value
  is the pixel's background, or smoke as steady as one.
- Smoke moves every background towards its own color. So of several such values, the one farthest from the smoke's is
  the background. The value is that of the channels' mean, with the weights that smoke changes most: gray smoke before a
  wall of its own brightness changes the wall's hue alone.

A pixel that only drifts may be clear as well. Its clearest moment may still hold some smoke, and so may a pixel beside
smoke that never changes: `_correction` takes that away before a smooth wall. All else is continued from around it, by
`_completed`. Clear areas are as smooth as smoke, so a proxy is enough to find them; `whole_plate` takes the
background's detail from whole frames.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.checks import Mask
from smokelift.extraction.matte import smoothing
from smokelift.extraction.proxy import Proxy
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import Edges
from smokelift.footage.images import (
    DETAIL,
    ISLAND,
    Picture,
    area_average,
    blurred,
    brightest_channel,
    in_one_piece,
    left_out_parts,
    linear_to_srgb,
    mostly_beside,
    push_pull,
    srgb_to_linear,
)
from smokelift.footage.noise import EIGHT_BIT_STEP, Noise, at_rank, count_of_seen, spread_over_time

WINDOW = 6.0
"""Width of the window of a pixel's clear values, in standard deviations of noise: three to either side."""

MIN_WINDOW = np.float32(3 / 255)
"""Smallest width of that window, in sRGB values: rounding to eight bits, and a codec's shift by a step either way."""

STRIDE = 4
"""Pixels from one row or column to the next of those that the smoke's properties are measured on."""

BAND = 2**14
"""Pixels that are compared at a time: they fit the cache."""

MIN_ALIKE_FRACTION = 0.8
"""Fraction of like values of a pixel above which they are its background for certain."""

MIN_SEEN_FRACTION = 1 / 8
"""Smallest fraction of the frames that must show a pixel for like values to be its background: a camera that turns
shows some pixels for a moment only."""

ONE_SIDED = 0.9
"""Fraction of the changes to one side from which on smoke only brightens, or only darkens; the rest is noise."""

FALSE_ALARM = 1e-3
"""Fraction of the pixels always under smoke that are taken for clear at times."""

PRIOR_PAIRS = 4.0
"""Pairs of frames that the clip's fraction of like pairs counts as, added to a pixel's own."""

DRIFT = 8 / 255
"""Largest change by a codec or by the light, in sRGB values."""

MIN_CHANGE_FRACTION = 1 / 4
"""Smallest range of smoke over time, over its difference from the background: a chair or a jacket is steadier."""

DETAIL_QUANTILE = 0.95
"""Quantile of the known background's detail that limits the unknown's; any more is the smoke's."""

MIN_TRANSMITTANCE = 0.2
"""Smallest transmittance of smoke at which the detail behind it exceeds noise."""

MIN_CONTRAST = 0.02
"""Smallest difference of the background from the smoke's brightness, in sRGB values, at which a mean tells how much of
it passes: noise and codecs change a mean by a code or two."""

MIN_STANDING = 0.05
"""Weight, in the smoothed value of a pixel, of painted smoke that never changes, above which that hides the pixel."""

SMOKE_LEFT = 1.7
"""Smoke that a pixel's clear values may hold, over their window and the fraction of the frames that are not clear: 1 to
1.7 in twelve composed clips (docs/experiments/hidden-plate.md)."""

SEEN_WIDTH = 0.06
"""Distance, over the longer side of the picture, over which smoke thins out from where it is seen to where it changes
nothing: half of that over which opacity has its range (docs/experiments/hidden-plate.md)."""

MAX_CORRECTION = 3.0
"""Difference of a clear moment from what is continued there, in standard deviations, beyond which it is an object's."""

FRAME_STRIDE = 2
"""One in so many examined frames is read at full size."""

DETAIL_MARGIN = 16
"""Pixels of the proxy around the unknown whose detail limits the unknown's."""


@dataclass(frozen=True, eq=False)
class CleanPlate:
    """The linear background (rows, columns, 3) of pictures of one exposure.

    ``known`` (rows, columns) are the pixels that some pictures show without smoke, ``clear`` (frames, rows, columns)
    says where each picture does. ``contrast`` (rows, columns) is the factor that makes the detail of the pictures' mean
    the background's, 0 where smoke hides it. ``correction`` (rows, columns, 3) is what was added to what they show.
    """

    image: Picture
    known: Mask
    clear: Mask
    contrast: Picture
    correction: Picture


def clean_plate(proxy: Proxy, noise: Noise, painted: Mask | None = None) -> CleanPlate:
    """Return the background of pictures of one exposure, whose file has a ``noise``.

    Where smoke is ``painted`` (rows, columns), what never changes is smoke, and no frame shows what is behind it.
    """
    width = smoothing(noise.averaged(proxy.scale**2))
    pictures, seen = proxy.pictures, proxy.seen
    weights = _most_changed(proxy.encoded[:, ::STRIDE, ::STRIDE], seen[:, ::STRIDE, ::STRIDE])
    values = np.stack([blurred(encoded @ weights, width) for encoded in proxy.encoded])
    values[~seen] = np.nan
    some = np.ascontiguousarray(values[:, ::STRIDE, ::STRIDE])
    window = max(WINDOW * spread_over_time(some), float(MIN_WINDOW))
    similarity, brightness, brightens = _smoke_of(some, window)
    height, across = values.shape[1:]
    brightens = np.repeat(np.repeat(brightens, STRIDE, 0), STRIDE, 1)[:height, :across]
    values *= np.where(brightens, np.float32(1), np.float32(-1))
    image, change = np.empty((height, across, 3), np.float32), np.empty((height, across), np.float32)
    known = np.empty((height, across), np.bool_)
    clear = np.empty(values.shape, np.bool_)
    rows = max(1, BAND // across)
    for row in range(0, height, rows):
        band = slice(row, row + rows)
        image[band], known[band], change[band], clear[:, band] = _clear_values(
            pictures[:, band], values[:, band], window, similarity
        )
    calm, never = change <= window + DRIFT, ~seen.any(0)
    if painted is not None:
        # beside it the smoothed values change as well
        never |= painted & (blurred((painted & calm).astype(np.float32), width) > MIN_STANDING)
    known, calm = in_one_piece(known & ~never), calm & ~never
    # a pixel that only drifts is background if it is so unlike its surroundings that smoke would change it more,
    unlike = np.abs(_unlike(image, known).mean(-1))
    known = in_one_piece(known | (calm & (MIN_CHANGE_FRACTION * unlike >= window + DRIFT)))
    # or if no channel differs from them by more than a drift: smoke hardly changes a background of its own color
    unlike = brightest_channel(np.abs(_unlike(image, known)))
    known = mostly_beside(in_one_piece(known | (calm & (unlike <= DRIFT))), known) & ~never
    mean = sum(encoded * shown[..., None] for encoded, shown in zip(proxy.encoded, seen, strict=True))
    mean = np.asarray(mean / np.maximum(seen.sum(0), 1)[..., None], np.float32)
    if never.any():
        mean[never] = push_pull(linear_to_srgb(image), known.astype(np.float32))[never]
        image[never] = srgb_to_linear(mean[never])
    # smoke thins out beside where it is seen
    hidden = np.asarray(1 - (clear & seen).sum(0) / np.maximum(seen.sum(0), 1), np.float32)
    hidden = np.maximum(hidden, blurred(hidden, SEEN_WIDTH * max(hidden.shape)))
    smoke = SMOKE_LEFT * window * hidden
    steady = in_one_piece(known & (change <= window) & (smoke < EIGHT_BIT_STEP / 2))
    correction = _correction(image, known, steady, weights, smoke)
    finer_than = DETAIL / proxy.scale
    whole, contrast = _completed(image + correction, known, mean, brightness, brightens, finer_than, weights)
    return CleanPlate(whole, known, clear, contrast, correction)


def _most_changed(encoded: Picture, seen: Mask) -> Picture:
    """The weights (3,) of the channels, of a sum of 1 but for signs, whose mean changes most over time.

    ``encoded`` are pictures (frames, rows, columns, 3) in sRGB values. A change counts the same from a codec's drift
    on, since faint smoke is what is hard to see.
    """
    away = (encoded - np.median(encoded, axis=0))[seen].astype(np.float64)
    away /= np.hypot(np.linalg.norm(away, axis=-1, keepdims=True), DRIFT)
    first = np.linalg.eigh(1 + away.T @ away)[1][:, -1]  # gray if nothing changes
    return np.asarray(np.copysign(1, first.sum()) * first / np.abs(first).sum(), np.float32)


def _correction(image: Picture, known: Mask, steady: Mask, weights: Picture, smoke: Picture) -> Picture:
    """What takes the last smoke from a linear background where it is ``known`` but not ``steady``.

    Its clear moments and what is continued from the steady pixels are two measurements of it: the first is off by as
    much ``smoke`` (rows, columns) as may be in it, the second by as much as where parts of the steady ones are left
    out.
    """
    encoded = linear_to_srgb(image)
    errors = [((continued - encoded) @ weights)[part] for continued, part in left_out_parts(encoded, steady)]
    if not errors:
        return np.zeros_like(image)
    away = push_pull(encoded, steady.astype(np.float32)) - encoded
    total = np.square(smoke) + np.square(np.concatenate(errors)).mean()
    likely = known & ~steady & (np.square(away @ weights) < MAX_CORRECTION**2 * total)
    return srgb_to_linear(encoded + np.where(likely, np.square(smoke) / total, 0)[..., None] * away) - image


def _unlike(image: Picture, known: Mask) -> Picture:
    """Difference (rows, columns, 3) of a linear picture from its known part, continued, in sRGB values."""
    encoded = linear_to_srgb(image)
    return encoded - push_pull(encoded, known.astype(np.float32))


def _smoke_of(pictures: Picture, window: float) -> tuple[float, float, Mask]:
    """Return the similarity of smoke in pictures (frames, rows, columns), its brightness, and where it brightens.

    Its similarity is the fraction of pairs of successive frames of smoke that are alike within a window. Its brightness
    is the value that it moves every background towards; it brightens pixels of a darker background.
    """
    shape = pictures.shape[1:]
    values = pictures.reshape(len(pictures), -1)
    ordered = np.sort(values, axis=0)
    counts = np.ones(ordered.shape, np.int16)  # values from each one up to a window above it
    for lag in range(1, len(ordered)):
        counts[:-lag] += ordered[lag:] - ordered[:-lag] <= window
    background = np.nan_to_num(at_rank(ordered, counts.argmax(0))) + np.float32(0.5 * window)
    away = values - background
    smoky = np.abs(away) > window
    pairs = smoky[1:] & smoky[:-1]
    similarity = float((np.abs(np.diff(values, axis=0)) <= window)[pairs].mean()) if pairs.any() else 0.5
    # a value that most frames agree on is the background for certain
    number = count_of_seen(values)
    certain = (counts.max(0) > MIN_ALIKE_FRACTION * number) & (number >= MIN_SEEN_FRACTION * len(values))
    behind = push_pull(background.reshape(*shape, 1), certain.reshape(shape).astype(np.float32)).ravel()
    # where the background is certain, a change as small as a codec's drift says nothing of smoke
    beyond = 0.5 * window + DRIFT
    change = np.where((np.abs(away) > beyond) & certain, away, 0.0)
    turn = _turn(background, change)
    if (change != 0).any(0).mean() < ISLAND:
        # Smoke that never leaves its place shows there all the time, and beside it by accident only. If it does not
        # change its place to one side, other things move as well and tell nothing of smoke.
        in_place = values - behind
        in_place = np.where(np.abs(in_place) > beyond, in_place, 0.0)
        if in_place.any() and np.isinf(side := _turn(behind, in_place)):
            change, turn = in_place, side
    if not change.any():
        return similarity, 1.0, np.ones(shape, np.bool_)
    thickest = np.quantile(values[change != 0], [0.01, 0.99])
    return similarity, float(np.clip(turn, *thickest)), (behind <= turn).reshape(shape)


def _turn(background: Picture, change: Picture) -> float:
    """The value below which changes (frames, n) brighten backgrounds (n,), and above which they darken them."""
    brighter, darker = (np.square(np.maximum(each, 0)).sum(0) for each in (change, -change))
    one_sided = ONE_SIDED * float((brighter + darker).sum())
    if brighter.sum() >= one_sided:
        return np.inf
    if darker.sum() >= one_sided:
        return -np.inf
    order = np.argsort(background)
    # the value that leaves the least change unexplained
    wrong = np.cumsum(darker[order]) + np.cumsum(brighter[order][::-1])[::-1]
    return float(background[order][wrong.argmin()])


def _clear_values(
    pictures: Picture, away: Picture, window: float, similarity: float
) -> tuple[Picture, Mask, Picture, Mask]:
    """The linear background of each pixel; whether it is certain; how far it changes; the frames that show it.

    An uncertain background is the least smoky value; that of a drifting pixel is the median. ``away`` is the pictures'
    value, negated where smoke darkens: the lower, the clearer.
    """
    unseen, number = np.isnan(away), count_of_seen(away)
    alike = (np.abs(np.diff(away, axis=0)) <= window).sum(0)
    pairs = (~unseen[1:] & ~unseen[:-1]).sum(0)
    ordered, last = np.sort(away, axis=0), np.maximum(number - 1, 0)
    # one value may be an outlier
    lowest, highest = at_rank(ordered, np.minimum(1, last)), at_rank(ordered, np.maximum(last - 1, 0))
    change = highest - lowest
    often = number >= MIN_SEEN_FRACTION * len(away)
    best = np.full(away.shape[1:], np.inf, np.float32)
    for value in away:
        inside = (away >= value) & (away <= value + np.float32(window))
        stays = (inside[1:] & inside[:-1]).sum(0)
        by_chance = (np.maximum(alike - stays, 0) + PRIOR_PAIRS * similarity) / (
            np.maximum(pairs - stays, 0) + PRIOR_PAIRS
        )
        certain = stays * np.log(np.clip(by_chance, 1e-6, 1 - 1e-6)) < np.log(FALSE_ALARM)
        certain |= (inside | unseen).all(0) & often
        np.copyto(best, value, where=certain & (value < best))
    known = np.isfinite(best)
    center = np.where(known, best, lowest) + np.float32(0.5 * window)
    center = np.where(change <= window + DRIFT, at_rank(ordered, np.minimum(number // 2, last)), center)
    for _ in range(3):  # mean shift settles the window around the mean of its values
        inside = np.abs(away - center) <= 0.5 * window * 1.001
        within = np.maximum(inside.sum(0), 1)
        center = np.where(inside, away, 0).sum(axis=0) / within
    value = np.einsum("tyxc,tyx->yxc", pictures, inside.astype(np.float32)) / within[..., None]
    return value.astype(np.float32), known, change, inside


def _completed(
    image: Picture,
    known: Mask,
    mean: Picture,
    brightness: float,
    brightens: Mask,
    finer_than: float,
    weights: Picture,
) -> tuple[Picture, Picture]:
    """Return a linear plate with the unknown filled in, and the ``contrast`` of `CleanPlate`.

    ``mean`` (rows, columns, 3) is that over time, in sRGB values. Smoke of transmittance T and brightness J makes
    J + T (B - J) of a background B. The mean's coarse part, compared with the continued surroundings, gives T; its
    detail divided by T is the background's.
    """
    smooth = push_pull(linear_to_srgb(image), known.astype(np.float32))
    coarse = blurred(mean, finer_than)
    contrast = smooth @ weights - brightness
    seen = (coarse @ weights - brightness) / np.where(np.abs(contrast) > MIN_CONTRAST, contrast, np.inf)
    detail = mean - coarse
    most = _most_detail(detail, known)
    passed = np.clip(seen, MIN_TRANSMITTANCE, 1)
    detail = np.clip(detail / passed[..., None], -most, most)
    filled = smooth + np.where(seen > MIN_TRANSMITTANCE, 1, 0)[..., None] * detail
    # smoke moves a pixel towards its own brightness, never away from it
    beyond = (filled - linear_to_srgb(image)) @ weights
    beyond -= np.clip(beyond, -DRIFT, DRIFT)
    beyond = np.where(brightens, np.maximum(beyond, 0), np.minimum(beyond, 0))
    filled -= beyond[..., None] * weights / (weights @ weights)
    filled = srgb_to_linear(np.maximum(filled, 0))
    contrast = np.where(known, 1, np.where(seen > MIN_TRANSMITTANCE, 1 / passed, 0)).astype(np.float32)
    return np.where(known[..., None], image, filled), contrast


def _most_detail(detail: Picture, known: Mask) -> Picture:
    """The largest usual detail (3,) where the picture is known: what is continued has no more."""
    return np.quantile(np.abs(detail[known]), DETAIL_QUANTILE, axis=0) if known.any() else np.zeros(3, np.float32)


def whole_plate(clip: Clip, proxy: Proxy, found: CleanPlate) -> Picture:
    """Return the linear background (rows, columns, 3) ``found`` on a proxy at full size, made of the same frames."""
    if found.image.shape[1::-1] == clip.size:
        return found.image
    shown = (found.clear & found.known)[::FRAME_STRIDE]
    known = shown.any(0)
    y, x = (_edges(*sizes) for sizes in zip(known.shape, clip.size[::-1], strict=True))
    file, whole = clip.whole(), np.zeros((*clip.size[::-1], 3), np.float32)
    shown = np.where(known, shown, True)
    times = shown.sum(0, dtype=np.float32)[..., None]
    for number, gain, clear in zip(proxy.numbers[::FRAME_STRIDE], proxy.gains[::FRAME_STRIDE], shown, strict=True):
        file.stored(number).add_weighted(clear[..., None] / (gain * times), (y, x), whole)
    whole += area_average(found.correction, *clip.size)
    if known.all():
        return whole
    (top, down), (left, right) = (
        (max(0, lines.start - DETAIL_MARGIN), min(n, lines.stop + DETAIL_MARGIN))
        for lines, n in zip(ndimage.find_objects((~known).astype(np.uint8))[0], known.shape, strict=True)
    )
    small = np.s_[top:down, left:right]
    part = np.s_[y[top] : y[down], x[left] : x[right]]
    size = x[right] - x[left], y[down] - y[top]
    mean = linear_to_srgb(whole[part])
    detail = mean - area_average(area_average(mean, right - left, down - top), *size)
    clearly = spread_out(known, clip.size)[part]
    most = _most_detail(detail, clearly)
    detail = np.clip(detail * spread_out(found.contrast, clip.size)[part][..., None], -most, most)
    filled = srgb_to_linear(np.maximum(area_average(linear_to_srgb(found.image[small]), *size) + detail, 0))
    whole[part] = np.where(clearly[..., None], whole[part], filled)
    return whole


def spread_out(values: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """Return values (rows, columns) of small pixels, repeated over a picture of a size (width, height)."""
    rows, columns = (np.diff(_edges(*sizes)) for sizes in zip(values.shape, size[::-1], strict=True))
    return np.repeat(np.repeat(values, rows, axis=0), columns, axis=1)


def _edges(count: int, pixels: int) -> Edges:
    """The beginnings of ``count`` parts of a line of pixels, and the end of the last."""
    return np.asarray(-(-np.arange(count + 1) * pixels // count), np.int32)
