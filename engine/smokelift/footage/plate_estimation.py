"""The clean plate of a clip from its frames alone.

Assumed: camera and background stand still. A pixel is a mixture over time of two states: clear, when it has one value
within the noise, and smoke, when it has any. Three facts tell them apart:

- A clear pixel stays; smoke goes on. Of two successive samples of smoke, some share is alike by chance, and it is
  measured on the pixel. A value at which a pixel stays for so many pairs of successive samples that smoke does so once
  in `FALSE_ALARM` only is its background, or smoke as steady as a background.
- Smoke draws every background towards its own brightness. So of several such values, the background is the one that is
  farthest from the smoke's.
- Stock footage stands before one colour, mostly black. Where the pixels that never change have one, it is behind all
  that do. Where they have two, it is the one that all pixels have at some time: the other is ink that stays.

A pixel that only drifts is clear as well if it looks like its surroundings, or so unlike them that smoke would
change more. A pixel without a certain value (over the source, as a rule) is unknown. What is behind it follows smoothly
from its neighbours; its detail is that of its samples, with the contrast that the smoke takes from it given back.

A camera that moves shows another part of the background in every frame, so a pixel has no value of its own: the
background has to be of one colour, or known frame by frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.clip import Clip
from smokelift.footage.exposure import sample_gains, small_size
from smokelift.footage.images import Picture, area_average, linear_to_srgb, srgb_to_linear
from smokelift.footage.matte import matte, smoothing
from smokelift.footage.noise import (
    BLOCK,
    NOISE_STRIDE,
    SMOKE_TO_NOISE,
    Noise,
    block_means,
    clear_deviation,
    decode_samples,
    drift,
    encode_sample,
    linear_samples,
    over_time,
    sample_block_means,
    sampled_count,
    temporal_noise,
    whole_blocks,
)
from smokelift.footage.plate import Plate
from smokelift.footage.seen import at_rank, count_of_seen, median_of_seen

STRIDE = 4
"""Pixels from one row or column to the next where it is measured what the smoke is like."""

MOST = 0.8
"""Share of a pixel's samples that have one value which is then its background for certain."""

LEAST_SEEN = 1 / 8
"""Share of the samples that have to show a pixel of which all of them are alike, for that to be its background: 4 of
32. While a camera turns, others show it for a moment only."""

ONE_SIDED = 0.9
"""Share of the changes by smoke to one side from which on it only brightens, or darkens, and the rest is noise."""

FALSE_ALARM = 1e-3
"""Share of the pixels always under smoke that pass for clear at times."""

WINDOW = 6.0
"""Width of the window of a pixel's clear samples in units of noise: plus and minus three standard deviations."""

LEAST_WINDOW = 3 / 255
"""The same at least: rounding to eight bits, and the shift of a codec by a step either way."""

DRIFT = 8 / 255
"""Change in sRGB values by a codec or by the light, at most. The matte takes as much for smoke."""

BAND = 2**14
"""Pixels whose samples are compared at a time: they fit the cache."""

LIKE_SURROUNDINGS = 3 * DRIFT
"""Difference in sRGB values from what the surroundings let expect, of a background."""

LEAST_CHANGE = 1 / 4
"""Range of smoke over time, as a share of its difference from the background: what is steadier is a chair or a jacket.
"""

PRIOR_PAIRS = 4.0
"""Pairs of samples that the clip's share of like pairs counts for beside a pixel's own."""

ONE_COLOUR = 0.8
"""Share of the pixels that never change which has to have one colour for it to be the backdrop's; the others are a
nozzle, a floor, a logo."""

ONE_COLOUR_NOISE = np.float32(6 / 255)
"""Most noise of a background of one colour, in sRGB values: a pixel that varies more while the camera moves sees more
than one colour."""

AT_ONCE = 0.5
"""Share of the blocks that smoke comes over between two samples, less than a fade or a cut changes at once
(docs/experiments/background.md)."""

ISLAND = 0.01
"""Share of the picture up to which what seems clear is taken for an accident."""

DETAIL = 4.0
"""Standard deviation in pixels of the Gaussian above which a background's detail is finer than that of smoke."""

MOST_DETAIL = 0.95
"""Quantile of the known background's detail that bounds that of the unknown; what is beyond it is smoke's."""

LEAST_TRANSMITTANCE = 0.2
"""Light let through by the smoke from which the detail behind it can be told from noise."""


@dataclass(frozen=True, eq=False)
class _Smoke:
    """What the smoke of a clip is like, in sRGB values.

    Attributes
    ----------
    likeness
        Share of the pairs of successive samples of smoke that are within a window.
    brightness
        Grey value that smoke draws every background towards.
    brightens : (rows, columns) bool
        Pixels whose background is darker than that, every `STRIDE`-th along both axes.
    """

    likeness: float
    brightness: float
    brightens: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SteadySamples:
    """Frames of a clip, all of one exposure.

    Attributes
    ----------
    pictures : (frames, rows, columns, 3) uint16
        sRGB values in fixed point; `decode_samples` reads them.
    """

    pictures: npt.NDArray[np.uint16]

    @cached_property
    def noise(self) -> Noise:
        """Of them."""
        return clip_noise(self.pictures)

    def backdrop(self) -> Plate | None:
        """Return the plate of a background of one colour, or None if it has more."""
        return backdrop_plate(self.pictures, self.noise)

    def plate(self) -> Plate:
        """Return the plate of a background of more than one colour."""
        found = clear_picture(self.pictures, self.noise)
        return Plate(found.image, found.known.astype(np.float32), self.noise)


@dataclass(frozen=True, eq=False)
class ClearPicture:
    """The background of samples of one exposure.

    Attributes
    ----------
    image : (rows, columns, 3)
        Linear.
    known : (rows, columns) bool
        Pixels that some of the samples show without smoke.
    clear : (frames, rows, columns) bool
        Where each of the samples shows the background that is known.
    contrast : (rows, columns)
        By what the detail of the samples' mean is multiplied to be that of the background; 0 where smoke hides it.
    """

    image: Picture
    known: npt.NDArray[np.bool_]
    clear: npt.NDArray[np.bool_]
    contrast: Picture


def estimate_plate(clip: Clip, sample_count: int = 32) -> Plate:
    """Estimate the background of a clip from its frames; the module says how.

    Parameters
    ----------
    clip
        Camera and background stand still.
    sample_count
        Frames that are sampled, spread evenly; fewer of very large pictures, to stay below half a gigabyte.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    samples = steady_samples(clip, sample_count)
    return samples.backdrop() or samples.plate()


def backdrop_plate(samples: npt.NDArray[np.uint16], noise: Noise) -> Plate | None:
    """Return the plate of a background of one colour, or None if it has more.

    ``samples`` (frames, rows, columns, 3) are of one exposure, as of `SteadySamples`.
    """
    backdrop = _backdrop(samples, noise)
    return None if backdrop is None else Plate(backdrop, np.ones(backdrop.shape[:2], np.float32), noise)


def clear_picture(
    samples: npt.NDArray[np.uint16],
    noise: Noise,
    seen: npt.NDArray[np.bool_] | None = None,
    detail: float = DETAIL,
) -> ClearPicture:
    """Return the background of samples.

    Parameters
    ----------
    samples : (frames, rows, columns, 3)
        Of one exposure, as of `SteadySamples`.
    noise
        Of them.
    seen : (frames, rows, columns) bool, optional
        Which pixels each of them shows; without it all.
    detail
        Standard deviation of the Gaussian as of `DETAIL`, in pixels of the samples.
    """
    width = smoothing(noise)
    grey = np.stack([_smooth_grey(sample, width) for sample in samples])

    def shown(*where: slice) -> Picture:
        values = decode_samples(grey[:, *where])
        if seen is not None:
            values[~seen[:, *where]] = np.nan
        return values

    coarse = shown(np.s_[::STRIDE], np.s_[::STRIDE])
    window = max(WINDOW * clear_deviation(coarse - median_of_seen(coarse)), LEAST_WINDOW)
    smoke = _smoke(coarse, window)
    brightens = np.repeat(np.repeat(smoke.brightens, STRIDE, 0), STRIDE, 1)[: grey.shape[1], : grey.shape[2]]
    height, width = samples.shape[1:3]
    image = np.empty((height, width, 3), np.float32)
    known, calm = np.empty((height, width), np.bool_), np.empty((height, width), np.bool_)
    clear = np.empty(samples.shape[:3], np.bool_)
    rows = max(1, BAND // width)
    for row in range(0, height, rows):
        band = slice(row, row + rows)
        values = shown(band)
        away = np.where(brightens[band], values, -values)
        image[band], known[band], calm[band] = _clear_value(
            samples[:, band], away, window, smoke.likeness, clear[:, band]
        )
    known = _in_one_piece(known)
    if not known.all():
        # what changes by drift at most is no smoke if it is too little like its surroundings for smoke so steady
        known = _in_one_piece(known | (calm & (LEAST_CHANGE * _unlike(image, known) >= window + DRIFT)))
    sure = known
    if not known.all():
        # or if it looks like them, too; that its difference is drift, and not faint smoke, is sure of a small one only
        apart = _unlike(image, known)
        alike = (_in_one_piece(known | (calm & (apart <= most))) for most in (DRIFT, LIKE_SURROUNDINGS))
        # surroundings that are unknown themselves speak for nothing
        sure, known = (_mostly_beside(each, known) for each in alike)
    mean = _mean(samples, seen)
    if seen is not None and not seen.any(0).all():
        never = ~seen.any(0)
        mean[never] = _filled(linear_to_srgb(image), sure.astype(np.float32))[never]
        image[never] = srgb_to_linear(mean[never])
    completed, contrast = _completed(image, known, sure, mean, smoke.brightness, brightens, detail)
    return ClearPicture(completed, known, clear, contrast)


def one_colour(plate: Plate) -> tuple[float, float, float] | None:
    """Return the linear colour of a plate that was estimated from a moving camera, or None if it has more than one."""
    known = plate.confidence > 0.5
    if known.mean() < 0.5 or plate.noise.total.max() > ONE_COLOUR_NOISE:
        return None
    red, green, blue = (float(v) for v in np.median(plate.image[known], axis=0))
    colour = np.broadcast_to(np.array([red, green, blue], np.float32), plate.image.shape)
    differs = matte(plate.image, Plate(colour, np.ones_like(plate.confidence), plate.noise)).mask
    return None if (differs & known).any() else (red, green, blue)


def steady_samples(clip: Clip, count: int = 32) -> SteadySamples:
    """Return frames spread evenly over a clip, all of one exposure.

    Parameters
    ----------
    clip
        The footage.
    count
        How many frames; fewer are returned of a shorter clip, and of pictures so large that they need too much memory.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    width, height = clip.size
    numbers = clip.spread(sampled_count(count, width, height))
    samples = np.empty((len(numbers), height, width, 3), np.uint16)
    tiny = []
    for sample, number in zip(samples, numbers, strict=True):
        sample[...] = clip.frame_through(number, encode_sample)
        tiny.append(clip.area_average(number, *small_size(width, height)))
    for sample, gain in zip(samples, sample_gains(np.stack(tiny)), strict=True):
        if (gain != 1).any():
            sample[...] = encode_sample(linear_samples(sample) / gain)
    return SteadySamples(samples)


def clip_noise(samples: npt.NDArray[np.uint16], seen: npt.NDArray[np.bool_] | None = None) -> Noise:
    """Return the noise of samples, as `clear_picture` takes them, before a background that is not known yet."""

    single = decode_samples(samples[:, ::NOISE_STRIDE, ::NOISE_STRIDE])
    blocks = np.stack([sample_block_means(sample) for sample in samples])
    if seen is not None:
        single[~seen[:, ::NOISE_STRIDE, ::NOISE_STRIDE]] = np.nan
        blocks[~whole_blocks(seen)] = np.nan
    single, blocks = (each - median_of_seen(each) for each in (single, blocks))
    noise = temporal_noise(single, blocks)
    # what drifts differs from the one background that is found
    left = noise.averaged(BLOCK**2).white
    drifting = np.array([drift(blocks[..., channel], left[channel]) for channel in range(3)], np.float32)
    return replace(noise, lasting=np.maximum(noise.lasting, drifting))


def _backdrop(samples: npt.NDArray[np.uint16], noise: Noise) -> Picture | None:
    """The linear picture (rows, columns, 3) of a background of one colour, or None if it has more.

    Whatever never changes and has another colour stands before the backdrop, and is part of the picture.
    """
    size = min(BLOCK, *samples.shape[1:3])
    linear = np.concatenate([block_means(linear_samples(sample[None])) for sample in samples])
    blocks = linear_to_srgb(linear)
    middle, limit = np.median(blocks, axis=0), SMOKE_TO_NOISE * noise.averaged(BLOCK**2).total
    still = (over_time(blocks - middle) <= limit).all(-1)
    if not still.any():
        return None
    # the median of many samples has less noise than they have, by pi / 2 more variance than their mean
    settled = SMOKE_TO_NOISE * noise.averaged(BLOCK**2 * max(1.0, len(samples) / (np.pi / 2))).total
    colours: list[Picture] = []
    kinds: list[npt.NDArray[np.bool_]] = []
    left = still
    while left.any() and len(kinds) < 2:  # the backdrop, and what stays before it
        colours.append(np.median(middle[left], axis=0))
        kinds.append((np.abs(middle - colours[-1]) <= settled).all(-1))
        left = left & ~kinds[-1]
    if left.sum() > (1 - ONE_COLOUR) * still.sum():
        return None
    seen = [(np.abs(blocks - colour) <= limit).all(-1) for colour in colours]
    covered = next((n for n, shown in enumerate(seen) if (still & kinds[n]).any() and _comes_over(shown)), None)
    if covered is None and kinds[0][still].mean() < ONE_COLOUR:
        return None
    alike = kinds[covered or 0]
    bare = alike if covered is None else seen[covered].any(0)
    clear = np.median(linear, axis=0)
    low, high = np.quantile(blocks, [0.05, 0.95], axis=0)
    fixed = still & ~alike & ~bare & ((high - low) <= limit).all(-1)
    picture = np.where(fixed[..., None], clear, clear[still & alike].mean(0))
    height, width = samples.shape[1:3]
    rows, columns = (np.minimum(np.arange(n) // size, m - 1) for n, m in zip((height, width), fixed.shape, strict=True))
    whole: Picture = picture[rows][:, columns].astype(np.float32)
    own = fixed[rows][:, columns]
    if own.any():
        whole[own] = np.median(linear_samples(samples[:, own]), axis=0)
    return whole


def _comes_over(shown: npt.NDArray[np.bool_]) -> bool:
    """Whether what has a colour in samples (frames, rows, columns) is what smoke comes over.

    Ink that spreads and stays is as still as what it hides. But its own colour is never seen where it has not come to,
    and what it hides is seen everywhere. A clip that fades in from black is black everywhere at a time, too: that
    leaves all of the picture at once, and smoke comes over one part after the other.
    """
    changes = shown[:, ~shown.all(0)]
    at_once = np.abs(np.diff(changes.mean(-1))).max(initial=0.0) if changes.size else 0.0
    return bool(shown.any(0).mean() >= 1 - ISLAND and at_once < AT_ONCE)


def _mean(samples: npt.NDArray[np.uint16], seen: npt.NDArray[np.bool_] | None) -> Picture:
    """The mean of samples in sRGB values, as far as they are seen."""
    if seen is None:
        return decode_samples(samples.sum(0, np.uint32)) / np.float32(len(samples))
    total = sum(decode_samples(sample) * shown[..., None] for sample, shown in zip(samples, seen, strict=True))
    return np.asarray(total / np.maximum(seen.sum(0), 1)[..., None], np.float32)


def _smooth_grey(sample: npt.NDArray[np.uint16], width: float) -> npt.NDArray[np.uint16]:
    """The grey of a sample, smoothed by so many pixels that most of its noise is gone."""
    grey = (sample[..., 0].astype(np.float32) + sample[..., 1] + sample[..., 2]) / np.float32(3)  # faster than a mean
    smooth: Picture = ndimage.gaussian_filter(grey, width)
    return smooth.astype(np.uint16)


def _smoke(grey: Picture, window: float) -> _Smoke:
    """What the smoke in samples (frames, rows, columns) is like."""
    shape = grey.shape[1:]
    values = grey.reshape(len(grey), -1)
    ordered = np.sort(values, axis=0)
    counts = _supports(ordered, window)
    number = count_of_seen(values)
    background = np.nan_to_num(at_rank(ordered, counts.argmax(0))) + np.float32(0.5 * window)
    away = values - background
    smoky = np.abs(away) > window
    pairs = smoky[1:] & smoky[:-1]
    alike = np.abs(np.diff(values, axis=0)) <= window
    likeness = float(alike[pairs].mean()) if pairs.any() else 0.5
    # what most samples agree on is the background for certain
    certain = (counts.max(0) > MOST * number) & (number >= LEAST_SEEN * len(values))
    # there, what a codec's drift may be says nothing of smoke
    change = np.where((np.abs(away) > 0.5 * window + DRIFT) & certain, away, 0.0)
    if not change.any():
        return _Smoke(likeness, 1.0, np.ones(shape, np.bool_))
    brighter, darker = (np.square(np.maximum(each, 0)).sum(0) for each in (change, -change))
    turn = _turn(background, brighter, darker)
    thickest = np.quantile(values[change != 0], [0.01, 0.99])
    brightness = float(np.clip(turn, *thickest))
    behind = _filled(background.reshape(*shape, 1), certain.reshape(shape).astype(np.float32))[..., 0]
    return _Smoke(likeness, brightness, behind <= turn)


def _turn(background: Picture, brighter: Picture, darker: Picture) -> float:
    """The grey value below which backgrounds are brightened and above which they are darkened, each by so much."""
    one_sided = ONE_SIDED * float((brighter + darker).sum())
    if brighter.sum() >= one_sided:
        return np.inf
    if darker.sum() >= one_sided:
        return -np.inf
    order = np.argsort(background)
    # the value that explains the most of the changes
    wrong = np.cumsum(darker[order]) + np.cumsum(brighter[order][::-1])[::-1]
    return float(background[order][wrong.argmin()])


def _supports(ordered: Picture, window: float) -> npt.NDArray[np.int16]:
    """Return how many samples lie from each one up to ``window`` above it; ordered along the first axis."""
    counts = np.ones(ordered.shape, np.int16)
    for lag in range(1, len(ordered)):
        counts[:-lag] += ordered[lag:] - ordered[:-lag] <= window
    return counts


def _clear_value(
    samples: npt.NDArray[np.uint16],
    away: Picture,
    window: float,
    likeness: float,
    clear: npt.NDArray[np.bool_],
) -> tuple[Picture, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return the background of each pixel, linear, whether it is certain, and whether the pixel changes like drift.

    Where it is not certain it is the least smoky value. That of a pixel that drifts is its middle one. ``away`` is the
    grey value of the samples, with its sign turned where smoke darkens: the less, the clearer. ``clear`` is filled with
    where each sample shows that background.
    """
    unseen, number = np.isnan(away), count_of_seen(away)
    some_unseen = bool(unseen.any())
    alike = _count(np.abs(np.diff(away, axis=0)) <= window)
    pairs = _count(~unseen[1:] & ~unseen[:-1])
    ordered, last = np.sort(away, axis=0), np.maximum(number - 1, 0)
    # one sample may be astray
    lowest, highest = at_rank(ordered, np.minimum(1, last)), at_rank(ordered, np.maximum(last - 1, 0))
    calm = highest - lowest <= window + DRIFT
    least = _least_stay(len(away) - 1, likeness)[pairs, alike]
    often = number >= LEAST_SEEN * len(away)
    best = np.full(away.shape[1:], np.inf, np.float32)
    for sample in away:
        inside = (away >= sample) & (away <= sample + window)
        stays = _count(inside[1:] & inside[:-1])
        certain = stays >= least
        # a pair is inside for certain if all samples are
        always = (inside | unseen).all(0) if some_unseen or len(away) == 1 else stays == len(away) - 1
        certain |= always & often
        np.copyto(best, sample, where=certain & (sample < best))
    known = np.isfinite(best)
    centre = np.where(known, best, lowest) + np.float32(0.5 * window)
    centre = np.where(calm, at_rank(ordered, np.minimum(number // 2, last)), centre)
    for _ in range(3):  # the window starts at a sample; mean shift settles it around the mean of its samples
        inside = np.abs(away - centre) <= 0.5 * window * 1.001
        within = np.maximum(_count(inside), 1)
        centre = np.where(inside, away, 0).sum(axis=0) / within
    clear[...] = inside
    value = np.einsum("tyxc,tyx->yxc", linear_samples(samples), inside.astype(np.float32)) / within[..., None]
    return value.astype(np.float32), known, calm


def _count(holds: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """How often something holds along the first axis, of fewer than 256."""
    return np.asarray(holds.view(np.uint8).sum(0, np.uint8))


@lru_cache(maxsize=1)
def _least_stay(most: int, likeness: float) -> npt.NDArray[np.uint8]:
    """For how many pairs of samples a pixel has to stay at a value that is its background.

    Parameters
    ----------
    most
        Pairs that there are.
    likeness
        As of `_Smoke`.

    Returns
    -------
    (pairs, alike) uint8
        By the number of a pixel's pairs, and of those that are alike; more than there are where none is enough.
    """
    pairs, alike, stays = np.ogrid[: most + 1, : most + 1, : most + 1]
    rest = np.maximum(pairs - stays, 0) + PRIOR_PAIRS
    share = (np.maximum(alike - stays, 0) + PRIOR_PAIRS * likeness) / rest
    enough = stays * np.log(np.clip(share, 1e-6, 1 - 1e-6)) < np.log(FALSE_ALARM)
    return np.where(enough.any(-1), enough.argmax(-1), most + 1).astype(np.uint8)


def _in_one_piece(known: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Without specks: a clear island amid smoke, or an unknown one amid the clear, is an accident of the samples."""
    smooth = ndimage.median_filter(known.astype(np.uint8), 7) > 0
    islands, count = ndimage.label(smooth)
    large = np.bincount(islands.ravel(), minlength=count + 1) > ISLAND * known.size
    large[0] = False
    kept: npt.NDArray[np.bool_] = large[islands]
    return kept


def _mostly_beside(grown: npt.NDArray[np.bool_], known: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Without patches that were added to what is known but border on less of it than of what stays unknown."""
    patches, count = ndimage.label(grown & ~known, structure=np.ones((3, 3)))
    beside = np.zeros(count + 1)
    for along, across in ((patches, grown), (patches.T, grown.T)):
        for one, other in ((np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[:-1])):
            border = (along[one] > 0) & (along[other] == 0)
            sides = np.where(across[other][border], 1, -1)
            beside += np.bincount(along[one][border], sides, count + 1)
    kept: npt.NDArray[np.bool_] = grown & (beside >= 0)[patches]
    return kept


def _completed(
    image: Picture,
    known: npt.NDArray[np.bool_],
    sure: npt.NDArray[np.bool_],
    mean: Picture,
    brightness: float,
    brightens: npt.NDArray[np.bool_],
    finer_than: float,
) -> tuple[Picture, Picture]:
    """Return a linear plate with what is unknown filled in, and the ``contrast`` of `ClearPicture`.

    ``mean`` is that of the samples in sRGB values.

    What is unknown is continued from what is sure. Other pixels are known only because they look like their
    surroundings: a few of them, at the rim of smoke that hardly changes, would spread over all that is behind it.

    Smoke of transmittance T and brightness J shows J + T (B - J) of a background B. The mean over time has T from its
    coarse part and that of the surroundings, and so what of its detail is the background's.
    """
    if known.all():
        return image, np.ones(known.shape, np.float32)
    smooth = _filled(linear_to_srgb(image), sure.astype(np.float32))
    coarse = ndimage.gaussian_filter(mean, (finer_than, finer_than, 0))
    contrast = smooth.mean(-1) - brightness
    seen = (coarse.mean(-1) - brightness) / np.where(np.abs(contrast) > 0.02, contrast, np.inf)
    detail = mean - coarse
    most = np.quantile(np.abs(detail[sure]), MOST_DETAIL, axis=0) if sure.any() else np.zeros(3, np.float32)
    passed = np.clip(seen, LEAST_TRANSMITTANCE, 1)
    detail = np.clip(detail / passed[..., None], -most, most)
    filled = smooth + np.where(seen > LEAST_TRANSMITTANCE, 1, 0)[..., None] * detail
    # smoke has drawn the pixel towards its own brightness, never away from it
    beyond = filled.mean(-1) - linear_to_srgb(image).mean(-1)
    beyond -= np.clip(beyond, -DRIFT, DRIFT)
    filled -= np.where(brightens, np.maximum(beyond, 0), np.minimum(beyond, 0))[..., None]
    filled = srgb_to_linear(np.maximum(filled, 0))
    contrast = np.where(known, 1, np.where(seen > LEAST_TRANSMITTANCE, 1 / passed, 0)).astype(np.float32)
    return np.where(known[..., None], image, filled), contrast


def _unlike(image: Picture, known: npt.NDArray[np.bool_]) -> Picture:
    """By how much a linear picture differs from what is known around, in grey sRGB values (rows, columns)."""
    encoded = linear_to_srgb(image)
    return np.asarray(np.abs((encoded - _filled(encoded, known.astype(np.float32))).mean(-1)))


def _filled(image: Picture, confidence: Picture) -> Picture:
    """Blend pixels of low confidence with the smooth continuation of their surroundings.

    The push-pull algorithm (Gortler et al., "The lumigraph", 1996): averages weighted by confidence over ever larger
    blocks; each level keeps what it knows and takes the rest from the next coarser one.
    """
    height, width = confidence.shape
    weight: Picture = confidence[..., None]
    if min(height, width) == 1 or float(confidence.min()) >= 1.0:
        return image
    small_size = ((width + 1) // 2, (height + 1) // 2)
    total = area_average(weight, *small_size)
    mean = area_average(image * weight, *small_size) / np.maximum(total, 1e-6)
    # A block of which a quarter is known is known: its mean is as good as any.
    coarse = _filled(mean, np.minimum(4.0 * total[..., 0], 1.0))
    blend: Picture = image * weight + area_average(coarse, width, height) * (np.float32(1.0) - weight)
    return blend
