"""The noise of a clip, measured in sRGB values, where that of cameras and codecs is about the same at every brightness.

It has two parts: one that differs from pixel to pixel, of which a mean over n pixels keeps the n-th part of the
variance, and one that lasts over many pixels, as a codec's does, of which a mean keeps all.

All statistics are quantiles over time, so that a flash, a cut or a dropped frame changes none of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.footage.images import Picture, linear_to_srgb, look_up, srgb_to_linear
from smokelift.footage.seen import median_of_seen, quantile_of_seen

EIGHT_BIT_STEP = np.float32(1 / 255)
"""One step of 8 bit video, in sRGB values: the least noise that a clip is taken to have, since codecs shift whole
blocks by that."""

NOISE_STRIDE = 3
"""Pixels from one row or column to the next where noise is measured: a ninth of the picture is enough for a median."""

BLOCK = 5
"""Pixels along the blocks over whose means the lasting noise is measured; they hold about as many as `matte` averages
over."""

BLOCKS_APART = 3
"""Blocks from one row or column of them to the next that tell the noise of large pictures: a median of so many needs no
more."""

STEADY_SHARE, STEADY_WIDTH = 0.9, 1.645
"""Share of a pixel's deviations over time that its noise is measured on, and how many standard deviations normal ones
reach there. The others may be a flash, a cut or smoke; a smaller share would miss the drift of a codec."""

CALM_SHARE, CALM_WIDTH = 0.25, 0.319
"""The same for smoke that comes over all of the picture for longer than `STEADY_SHARE` leaves out, as a burst does."""

BURST = 10.0
"""Ratio of the two, each at the stillest tenth of the pixels, from which on it is such smoke. Of 161 public clips three
bursts on black have 32 to 86, a rendered scene 13, codecs, hands and lights that change 9 at most
(docs/experiments/background.md)."""

FEWEST_CALM = 16
"""Samples over time from which on a quarter of them tells how still a pixel is: the nearest two of five may be alike by
chance, as stripes are that a moving camera sees."""

SMOKE_TO_NOISE = 3.0
"""Deviation over time, in units of the stillest tenth's, above which it is smoke and not noise
(docs/experiments/background.md)."""

CLIPPED_MEAN = 1.1
"""Mean of normal noise whose negative half is clipped, at most, in median differences of two of its values: it is 1.02
of them, and rounding adds some."""

_FIXED_POINT = 8192
"""Steps of a stored sample in one unit of sRGB: 16 bits hold values up to 8."""

_SAMPLE_BYTES = 512 * 2**20
"""Memory for the stored samples of a clip: 32 frames of 1080p fit."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Standard deviations of a static pixel, in sRGB values.

    Attributes
    ----------
    white : (3,)
        Of what differs from pixel to pixel.
    lasting : (3,)
        Of what neighbours share.
    """

    white: Picture
    lasting: Picture

    @property
    def total(self) -> Picture:
        """Standard deviation of a pixel, shape (3,)."""
        total: Picture = np.sqrt(self.white**2 + self.lasting**2)
        return total

    def averaged(self, pixels: float) -> Noise:
        """Return the noise of means over so many pixels."""
        return Noise(self.white / np.float32(np.sqrt(max(pixels, 1.0))), self.lasting)


def lasting_noise(deviation: npt.ArrayLike) -> Noise:
    """Return noise that no mean lessens, of a standard deviation in sRGB values, one or one a channel."""
    return Noise(np.zeros(3, np.float32), np.broadcast_to(np.asarray(deviation, np.float32), (3,)).copy())


EIGHT_BIT_NOISE = lasting_noise(EIGHT_BIT_STEP)
"""Of footage that is as clean as eight bits allow."""


def sampled_count(count: int, width: int, height: int) -> int:
    """Return how many pictures of a size are stored of so many that are asked for."""
    return min(count, max(3, _SAMPLE_BYTES // (width * height * 6)))


def encode_sample(linear: Picture) -> npt.NDArray[np.uint16]:
    """Return a linear picture in sRGB values as fixed point."""
    return as_samples(linear_to_srgb(linear))


def as_samples(encoded: Picture) -> npt.NDArray[np.uint16]:
    """Return sRGB values as fixed point."""
    return np.clip(encoded * _FIXED_POINT + 0.5, 0, 65535).astype(np.uint16)


def decode_samples(samples: npt.NDArray[np.uint16] | npt.NDArray[np.uint32]) -> Picture:
    """Return what `encode_sample` stored, or sums of that, as float32 sRGB values."""
    return samples.astype(np.float32) / np.float32(_FIXED_POINT)


def linear_samples(samples: npt.NDArray[np.uint16]) -> Picture:
    """Return what `encode_sample` stored as float32 linear values."""
    return look_up(_LINEAR, samples)


def block_means(pictures: Picture) -> Picture:
    """Return the means over blocks of pictures (frames, rows, columns, 3); what fills no block is left out."""
    size = min(BLOCK, *pictures.shape[1:3])
    frames, rows, columns = len(pictures), pictures.shape[1] // size, pictures.shape[2] // size
    whole = pictures[:, : rows * size, : columns * size]
    lines = whole.reshape(frames, rows, size, columns * size * 3).sum(axis=2)  # along memory: several times faster
    means: Picture = lines.reshape(frames, rows, columns, size, 3).sum(axis=3) / np.float32(size**2)
    return means


def even_out(samples: npt.NDArray[np.uint16], gains: Picture) -> None:
    """Bring samples (frames, rows, columns, 3), as of `encode_sample`, to one exposure, in place.

    ``gains`` (frames, 3) say by how much each is brighter than the others.
    """
    for sample, gain in zip(samples, gains, strict=True):
        if (gain != 1).any():
            sample[...] = encode_sample(linear_samples(sample) / gain)


def sample_block_means(sample: npt.NDArray[np.uint16]) -> Picture:
    """Return the `block_means` of a sample (rows, columns, 3) in sRGB values, (rows, columns, 3).

    The sums are whole numbers below 2^24, which float32 holds exactly: as if the sample were decoded first.
    """
    size = min(BLOCK, *sample.shape[:2])
    rows, columns = sample.shape[0] // size, sample.shape[1] // size
    lines = sample[: rows * size, : columns * size].reshape(rows, size, columns * size * 3)
    sums = _sum_of([lines[:, k] for k in range(size)]).reshape(rows, columns, size, 3)
    total = _sum_of([sums[:, :, k] for k in range(size)])
    return total.astype(np.float32) / np.float32(_FIXED_POINT) / np.float32(size**2)


def some_blocks(picture: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a picture of some blocks of another, side by side, `BLOCKS_APART`."""
    step = BLOCKS_APART * BLOCK
    rows, columns = (n // step for n in picture.shape[:2])
    values = picture.shape[2:]
    whole = picture[: rows * step, : columns * step].reshape(rows, step, columns, step, *values)
    return np.ascontiguousarray(whole[:, :BLOCK, :, :BLOCK]).reshape(rows * BLOCK, columns * BLOCK, *values)


def whole_blocks(seen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return which of the blocks of `block_means` are seen whole, of pixels (frames, rows, columns) that are seen."""
    size = min(BLOCK, *seen.shape[1:])
    frames, rows, columns = len(seen), seen.shape[1] // size, seen.shape[2] // size
    whole = seen[:, : rows * size, : columns * size].reshape(frames, rows, size, columns, size)
    return np.asarray(whole.all(axis=(2, 4)))


def _sum_of(parts: Sequence[npt.NDArray[Any]]) -> npt.NDArray[np.uint32]:
    """Whole numbers added up without a copy of them all."""
    total = parts[0].astype(np.uint32)
    for part in parts[1:]:
        total += part
    return total


def temporal_noise(deviations: Picture, blocks: Picture) -> Noise:
    """Return the noise of the pixels that show no smoke; of it at least one step of 8 bit video lasts.

    A pixel's noise follows from the quantile of its deviations over time that holds `STEADY_SHARE` of them. Smoke is
    over the pixels whose noise exceeds that of the stillest tenth by `SMOKE_TO_NOISE`; the median of the
    others is the clip's. Differences of successive frames would be too small: a codec repeats a static block for some
    frames and then replaces it.

    Parameters
    ----------
    deviations : (frames, rows, columns, 3)
        From the background, in sRGB values.
    blocks : (frames, rows, columns, 3)
        The same of `block_means`.
    """
    single, shared = (
        np.array([clear_deviation(each[..., channel]) for channel in range(3)]) for each in (deviations, blocks)
    )
    pixels = np.float32(BLOCK**2)
    white = np.maximum(single**2 - shared**2, 0) * pixels / (pixels - 1)
    lasting = np.sqrt(np.maximum(single**2 - white, 0))
    return Noise(np.sqrt(white).astype(np.float32), np.maximum(lasting, EIGHT_BIT_STEP).astype(np.float32))


def clipped_black(deviations: Picture, blocks: Picture) -> Picture:
    """Return how bright a noisy black is on the mean, since noise below black is clipped, in sRGB values.

    It is the deviation of the darkest tenth of the blocks, each at its median over time, as far as noise explains it: a
    background that is told wrong, or smoke that fills the picture, deviates more. 0 for what is less than a step of 8
    bit video.

    Parameters
    ----------
    deviations, blocks
        As `temporal_noise` takes them.

    Returns
    -------
    (3,) float32
    """
    apart = np.abs(deviations[:, :, 1:] - deviations[:, :, :-1])
    explained = CLIPPED_MEAN * np.nanmedian(apart, axis=(0, 1, 2)) if apart.size else 0
    offset = np.minimum(np.nanquantile(median_of_seen(blocks), 0.1, axis=(0, 1)), explained)
    return np.where(offset < EIGHT_BIT_STEP, 0, offset).astype(np.float32)


def over_time(deviations: Picture) -> Picture:
    """Return the standard deviation over time, the first axis, of all but a flash.

    Where even the stillest tenth deviates far more than in the calmest part of the time (`BURST`), smoke comes over
    all of the picture, and that part tells it.
    """
    size = np.abs(deviations)
    width: Picture = quantile_of_seen(size, STEADY_SHARE) / np.float32(STEADY_WIDTH)
    if len(size) >= FEWEST_CALM and _stillest(width) > BURST * EIGHT_BIT_STEP:  # no less can exceed it
        calm: Picture = quantile_of_seen(size, CALM_SHARE) / np.float32(CALM_WIDTH)
        if _stillest(width) > BURST * _stillest(calm):
            return calm
    return width


def clear_deviation(deviations: Picture) -> float:
    """Return the standard deviation over time of the pixels without smoke; see `temporal_noise`.

    Parameters
    ----------
    deviations : (frames, rows, columns)
        From the background.
    """
    return float(np.median(_of_clear(over_time(deviations))))


def drift(deviations: Picture, white: float) -> float:
    """Return the root mean square where `clear_deviation` returns the median: what a codec lets drift counts.

    White noise of a standard deviation is taken off first, lest smoke as thin as that noise counts.
    """
    squares = np.maximum(over_time(deviations) ** 2 - np.float32(white**2), 0)
    return float(np.sqrt(np.mean(_of_clear(np.sqrt(squares)) ** 2)))


def _of_clear(each: Picture) -> Picture:
    """Those of the pixels' deviations over time that no smoke explains, (n,)."""
    clear: Picture = each[each <= SMOKE_TO_NOISE * _stillest(each)]
    return clear


def _stillest(each: Picture) -> float:
    """The deviation over time of the stillest tenth of the pixels that are seen, at least a step of 8 bit video."""
    return max(float(np.quantile(each[np.isfinite(each)], 0.1)), float(EIGHT_BIT_STEP))


def linear_excess(encoded: Picture, deviation: npt.ArrayLike) -> Picture:
    """Return by how much noise of sRGB values makes linear light brighter on the mean, at sRGB values.

    Light is a convex function of sRGB values, so that the mean of f(v + n) exceeds f(v) by half of the noise's variance
    times the second derivative of f. At a noisy value the term has the same mean, up to the fourth order in the noise.

    Parameters
    ----------
    encoded : (..., 3)
        sRGB values, noisy or not.
    deviation
        Standard deviation of the noise, in sRGB values, one or one a channel.
    """
    # the second derivative of the curve of `srgb_to_linear`
    curvature = 2.4 * 1.4 / 1.055**2 * ((np.maximum(encoded, 0.04) + 0.055) / 1.055) ** 0.4
    excess = np.where(encoded > 0.04, 0.5 * np.square(deviation) * curvature, 0)
    return np.asarray(excess, np.float32)


def linear_per_srgb(encoded: Picture) -> Picture:
    """Return the derivative of linear light by the sRGB value, at sRGB values: what turns their noise into linear."""
    half = EIGHT_BIT_STEP / 2
    return (srgb_to_linear(encoded + half) - srgb_to_linear(encoded - half)) / EIGHT_BIT_STEP


_LINEAR = srgb_to_linear(np.arange(65536, dtype=np.float32) / np.float32(_FIXED_POINT))
"""Linear values of all stored samples."""
