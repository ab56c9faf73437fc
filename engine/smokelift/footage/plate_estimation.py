"""The clean plate of a clip from its frames alone.

Assumed: camera and background stand still. In this order:

1. `backdrop` tells a background of one colour, as that of most stock footage, and is done.
2. `clear_values` finds for each pixel which of its values over time is clear of smoke.
3. A pixel that only drifts is clear as well if it looks like its surroundings, or so unlike them that smoke would
   change more. A pixel without a certain value (over the source, as a rule) is unknown.
4. `behind_smoke` continues what is unknown from what is known around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from smokelift.footage.backdrop import backdrop_plate
from smokelift.footage.behind_smoke import (
    DETAIL,
    DRIFT,
    completed,
    continuation_errors,
    in_one_piece,
    mostly_beside,
    push_pull,
    thin_rim,
    unlike,
)
from smokelift.footage.clear_values import STRIDE, clear_values, smoke_of
from smokelift.footage.clip import Clip
from smokelift.footage.exposure import sample_gains, small_size
from smokelift.footage.images import Picture, blurred, linear_to_srgb, srgb_to_linear
from smokelift.footage.matte import smoothing
from smokelift.footage.noise import (
    BLOCK,
    NOISE_STRIDE,
    Noise,
    clear_deviation,
    decode_samples,
    drift,
    encode_sample,
    even_out,
    sample_block_means,
    sampled_count,
    temporal_noise,
    whole_blocks,
)
from smokelift.footage.plate import Plate
from smokelift.footage.seen import median_of_seen

WINDOW = 6.0
"""Width of the window of a pixel's clear samples in units of noise: plus and minus three standard deviations."""

LEAST_WINDOW = 3 / 255
"""The same at least: rounding to eight bits, and the shift of a codec by a step either way."""

BAND = 2**14
"""Pixels whose samples are compared at a time: they fit the cache."""

LIKE_SURROUNDINGS = 3 * DRIFT
"""Difference in sRGB values from what the surroundings let expect, of a background."""

LEAST_CHANGE = 1 / 4
"""Range of smoke over time, as a share of its difference from the background: what is steadier is a chair or a jacket.
"""


@dataclass(frozen=True, eq=False)
class SteadySamples:
    """Frames of a clip, all of one exposure.

    Attributes
    ----------
    pictures : (frames, rows, columns, 3) uint16
        sRGB values in fixed point; `decode_samples` reads them.
    seen : (frames, rows, columns) bool, optional
        What no mask hides; without it all.
    """

    pictures: npt.NDArray[np.uint16]
    seen: npt.NDArray[np.bool_] | None = None

    @cached_property
    def noise(self) -> Noise:
        """Of them."""
        return clip_noise(self.pictures, self.seen)

    def backdrop(self) -> Plate | None:
        """Return the plate of a background of one colour, or None if it has more."""
        return backdrop_plate(self.pictures, self.noise, self.seen)

    def plate(self) -> Plate:
        """Return the plate of a background of more than one colour."""
        found = clear_picture(self.pictures, self.noise, self.seen, masked=True)
        return Plate(found.image, found.known.astype(np.float32), self.noise, found.errors)


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
    errors : (3, 3)
        As of `smokelift.footage.plate.Plate`.
    """

    image: Picture
    known: npt.NDArray[np.bool_]
    clear: npt.NDArray[np.bool_]
    contrast: Picture
    errors: Picture


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


def clear_picture(
    samples: npt.NDArray[np.uint16],
    noise: Noise,
    seen: npt.NDArray[np.bool_] | None = None,
    detail: float = DETAIL,
    masked: bool = False,
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
    masked
        Whether what no sample shows is hidden by a mask: then it is unknown. Else it lies beyond all of them.
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
    smoke = smoke_of(coarse, window)
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
        image[band], known[band], calm[band] = clear_values(
            samples[:, band], away, window, smoke.likeness, clear[:, band]
        )
    known = in_one_piece(known)
    if not known.all():
        # what changes by drift at most is no smoke if it is too little like its surroundings for smoke so steady
        known = in_one_piece(known | (calm & (LEAST_CHANGE * unlike(image, known) >= window + DRIFT)))
    sure = known
    if not known.all():
        # or if it looks like them, too; that its difference is drift, and not faint smoke, is sure of a small one only
        apart = unlike(image, known)
        alike = (in_one_piece(known | (calm & (apart <= most))) for most in (DRIFT, LIKE_SURROUNDINGS))
        # surroundings that are unknown themselves speak for nothing
        sure, known = (mostly_beside(each, known) for each in alike)
        # what is not seen is no sign of smoke
        thin = thin_rim(image, known, brightens, clear if seen is None else clear | ~seen)
        sure, known = sure & ~thin, known & ~thin
    mean = _mean(samples, seen)
    if seen is not None and not seen.any(0).all():
        never = ~seen.any(0)
        if masked:
            sure, known = sure & ~never, known & ~never
        mean[never] = push_pull(linear_to_srgb(image), sure.astype(np.float32))[never]
        image[never] = srgb_to_linear(mean[never])
    complete, contrast = completed(image, known, sure, mean, smoke.brightness, brightens, detail)
    return ClearPicture(complete, known, clear, contrast, continuation_errors(complete, sure))


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
        tiny.append(clip.as_seen(number, clip.area_average(number, *small_size(width, height))))
    even_out(samples, sample_gains(np.stack(tiny)))
    return SteadySamples(samples, seen_of(clip, numbers, width, height))


def seen_of(clip: Clip, numbers: Sequence[int], width: int, height: int) -> npt.NDArray[np.bool_] | None:
    """Return the `Clip.seen` of frames as one array (frames, height, width); None of a clip without a mask."""
    seen = [each for number in numbers if (each := clip.seen(number, width, height)) is not None]
    return np.stack(seen) if seen else None


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


def _mean(samples: npt.NDArray[np.uint16], seen: npt.NDArray[np.bool_] | None) -> Picture:
    """The mean of samples in sRGB values, as far as they are seen."""
    if seen is None:
        return decode_samples(samples.sum(0, np.uint32)) / np.float32(len(samples))
    total = sum(decode_samples(sample) * shown[..., None] for sample, shown in zip(samples, seen, strict=True))
    return np.asarray(total / np.maximum(seen.sum(0), 1)[..., None], np.float32)


def _smooth_grey(sample: npt.NDArray[np.uint16], width: float) -> npt.NDArray[np.uint16]:
    """The grey of a sample, smoothed by so many pixels that most of its noise is gone."""
    grey = (sample[..., 0].astype(np.float32) + sample[..., 1] + sample[..., 2]) / np.float32(3)  # faster than a mean
    return blurred(grey, width).astype(np.uint16)
