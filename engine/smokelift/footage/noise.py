"""How the frames of a clip differ where nothing changes: by noise, and by exposure.

Noise is measured in sRGB values: there noise of cameras and codecs is about the same at every brightness.

White noise differs from pixel to pixel: a mean over n pixels keeps the n-th part of its variance. Lasting noise, like a
codec's, is shared by many pixels: a mean keeps all of it.

Neither is measured on what moves, since smoke may fill the picture. White noise is how differences of neighboring
pixels change from frame to frame: smoke has hardly any detail so fine. Lasting noise is how far samples that agree on a
background spread about it.

The exposure of a frame against its background is one gain for each channel. Where there is no smoke, their ratio is the
gain; smoke spreads it. So the gain is the middle of the shortest interval that holds a third of the ratios (the shorth:
Andrews et al., "Robust estimates of location", 1972).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.footage.images import Picture, area_average, brightest_channel, reduced_size, srgb_to_linear

EIGHT_BIT_STEP = np.float32(1 / 255)
"""One step of 8 bit video (by definition), in sRGB values: the smallest noise a clip is taken to have, since codecs
shift whole blocks by it."""

BLOCK = 5
"""Pixels along the blocks in which white noise is measured, and on whose means lasting noise is; `matte` averages over
about as many pixels."""

BLOCKS_APART = 3
"""Blocks from one row or column to the next of those that white noise is measured in: its median needs no more."""

MEDIAN_OF_BLOCK = 0.955
"""Median over mean of a block's sum of squared differences. 20 differences of neighbors in rows of five have k = 14.5
degrees of freedom, and the median of chi-squared is (1 - 2 / (9 k))^3 of its mean (by definition)."""

LARGEST_LASTING = np.float32(4 / 255)
"""Largest lasting noise, in sRGB values: a codec's changes are up to twice as large (`clean_plate.DRIFT`)."""

MIN_SLOW = 0.95 * float(LARGEST_LASTING)
"""Spread about the median over time, in sRGB values, from which on it is wider than that of noise: slow smoke."""

MAX_QUICK = 0.5
"""Largest part of that spread which is noise beside slow smoke: four public clips full of it have .12 to .44, two with
people and an exposure that changes .59 and .82 (docs/experiments/background.md)."""

SPREAD_SAMPLES, SPREAD_ROUNDS = 50_000, 25
"""Largest number of deviations that a spread is measured on, and rounds in which it settles to a hundredth."""

MIN_SPREAD = EIGHT_BIT_STEP / 4
"""Smallest spread, in sRGB values, that is distinguished from none: rounding to 8 bits makes as much."""

CLIPPED_MEAN = 1.1
"""Largest mean of normal noise whose negative half is clipped, over the median difference of two of its values: 1.02,
and some for rounding."""

COMPARED_SIDE = 160
"""Pixels along the longer side of compared pictures: few enough to average out noise, and still thousands."""

USABLE = (0.005, 0.9)
"""Linear values between which a ratio is usable: below there is noise, above clipping."""

MIN_USABLE_FRACTION = 0.01
"""Smallest usable fraction of a picture."""

AGREEING = 1 / 3
"""Share of the usable pixels that must show one gain."""

UNCHANGED = 0.1
"""Share of the usable pixels with a ratio of one that proves an unchanged exposure."""

SAME = 0.02
"""Relative difference of gains that is invisible: less than a step of 8 bit video."""

SPREAD = 0.06
"""Largest spread of the log ratios of pixels that show one gain."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Standard deviations (3,) of a static pixel, in sRGB values: of the white and of the lasting noise.

    The lasting noise is ``shared`` by many pixels, as far as it was measured, but ``least`` at least.
    """

    white: Picture
    shared: Picture
    least: float = 0.0

    @property
    def lasting(self) -> Picture:
        """Standard deviation (3,) of the lasting noise."""
        return np.maximum(self.shared, self.least)

    @property
    def total(self) -> Picture:
        """Standard deviation (3,) of both together."""
        return np.asarray(np.sqrt(self.white**2 + self.lasting**2))

    def averaged(self, pixels: float) -> "Noise":
        """Return the noise of means over a number of pixels."""
        return replace(self, white=self.white / np.float32(np.sqrt(max(pixels, 1.0))))


def lasting_noise(deviation: npt.ArrayLike) -> Noise:
    """Return lasting noise alone, of a standard deviation, or one for each channel, in sRGB values."""
    return Noise(np.zeros(3, np.float32), np.broadcast_to(np.asarray(deviation, np.float32), (3,)).copy())


EIGHT_BIT_NOISE = Noise(np.zeros(3, np.float32), np.full(3, MIN_SPREAD), float(EIGHT_BIT_STEP))
"""Noise of footage as clean as eight bits allow (by definition)."""


def noise_block_means(pictures: Picture) -> Picture:
    """Return the means over blocks of pictures (frames, rows, columns, 3); edges that fill no block are left out."""
    size = min(BLOCK, *pictures.shape[1:3])
    frames, rows, columns = len(pictures), pictures.shape[1] // size, pictures.shape[2] // size
    whole = pictures[:, : rows * size, : columns * size]
    lines = whole.reshape(frames, rows, size, columns * size * 3).sum(axis=2)  # in memory order: several times faster
    return np.asarray(lines.reshape(frames, rows, columns, size, 3).sum(axis=3) / np.float32(size**2))


def some_blocks(picture: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a picture's blocks, one every `BLOCKS_APART`, side by side; a small picture as it is."""
    step = BLOCKS_APART * BLOCK
    if min(picture.shape[:2]) < step:
        return picture
    rows, columns = (n // step for n in picture.shape[:2])
    values = picture.shape[2:]
    whole = picture[: rows * step, : columns * step].reshape(rows, step, columns, step, *values)
    return np.ascontiguousarray(whole[:, :BLOCK, :, :BLOCK]).reshape(rows * BLOCK, columns * BLOCK, *values)


def white_noise(blocks: Picture) -> Picture:
    """Return the standard deviation (3,) of white noise.

    ``blocks`` (frames, rows, columns, 3) are `some_blocks` of pictures of one exposure, or of their deviations, in sRGB
    values; NaN where a mask hides them.
    """
    frames, rows, columns = blocks.shape[:3]
    size = min(BLOCK, rows, columns)
    if frames < 2 or size < 2:
        return np.zeros(3, np.float32)
    whole = blocks[:, : rows // size * size, : columns // size * size]
    apart = np.diff(whole.reshape(frames, rows // size, size, columns // size, size, 3), axis=4)
    # a difference of four values has four times their variance
    variances = np.square(np.diff(apart, axis=0)).mean((2, 4)) / 4
    median = np.nan_to_num(np.nanmedian(variances, axis=(0, 1, 2)))
    return np.asarray(np.sqrt(median / MEDIAN_OF_BLOCK), np.float32)


def spread_about(deviations: Picture, largest: np.float32 = LARGEST_LASTING) -> Picture:
    """Return the `peak_spread` (3,) of each channel of deviations (..., 3)."""
    return np.array([peak_spread(deviations[..., channel], largest) for channel in range(3)], np.float32)


def peak_spread(deviations: Picture, largest: np.float32 = LARGEST_LASTING) -> float:
    """Return the standard deviation, up to ``largest``, of those deviations from a background that are noise.

    Deviations are a mixture of noise, normal about zero, and smoke, with all sizes, each as often as its double. The
    likeliest mixture is found from little noise upwards, which makes it that of the peak at zero (Dempster, Laird and
    Rubin, "Maximum likelihood from incomplete data via the EM algorithm", 1977). NaNs are left out.
    """
    some = deviations.ravel()[:: max(1, deviations.size // SPREAD_SAMPLES)]
    size = np.abs(some[np.isfinite(some)])
    squares = np.square(size)
    smoke = 1 / (np.maximum(size, EIGHT_BIT_STEP) * np.float32(1 - np.log(EIGHT_BIT_STEP)))
    variance, fraction = float(EIGHT_BIT_STEP**2), 0.5
    for _ in range(SPREAD_ROUNDS if squares.size else 0):
        noise = fraction * np.sqrt(2 / np.pi / variance) * np.exp(-0.5 * squares / np.float32(variance))
        weight = noise / (noise + np.float32(1 - fraction) * smoke)
        fraction = float(weight.mean())
        variance = float((weight * squares).sum() / max(float(weight.sum()), 1e-6))
        variance = min(max(variance, float(MIN_SPREAD**2)), float(largest**2))
    return float(np.sqrt(variance))


def spread_over_time(values: Picture) -> float:
    """Return the standard deviation of the noise of values (frames, ...): how far they spread about their medians.

    Slow smoke all over a picture spreads further than noise, and without a peak. Less the means of the frames before
    and after there is hardly anything left of it, and if little is left in all, that is the noise.
    """
    spread = peak_spread(values - median_of_seen(values))
    if spread < MIN_SLOW or len(values) < 3:
        return spread
    # what differs from a mean of two others spreads as far as three halves of the variance of each
    quick = peak_spread(values[1:-1] - 0.5 * (values[:-2] + values[2:])) / 1.5**0.5
    return quick if quick < MAX_QUICK * spread else spread


def noise_about(deviations: Picture, blocks: Picture) -> Noise:
    """Return the noise of pictures before a known background.

    Both arguments (frames, rows, columns, 3) are made of the differences from it in sRGB values: ``deviations`` are
    `some_blocks` of them, ``blocks`` their `noise_block_means`.
    """
    return noise_of(white_noise(deviations), spread_about(blocks), BLOCK**2)


def noise_of(white: Picture, spread: Picture, pixels: float) -> Noise:
    """Return the noise with a ``white`` part (3,) whose means over a number of pixels have a ``spread`` (3,)."""
    shared = np.sqrt(np.maximum(spread**2 - white**2 / np.float32(pixels), MIN_SPREAD**2))
    return Noise(white, shared.astype(np.float32), float(EIGHT_BIT_STEP))


def clipped_black(deviations: Picture, blocks: Picture) -> Picture:
    """Return how bright a noisy black is on the mean (3,), in sRGB values: noise below black is clipped.

    It is the deviation of the darkest tenth of the blocks, by their medians over time, as far as noise explains it; a
    wrong background, or smoke that fills the picture, deviates more. Less than a step of 8 bit video counts as 0. The
    arguments are those of `noise_about`.
    """
    apart = np.abs(deviations[:, :, 1:] - deviations[:, :, :-1])
    explained = CLIPPED_MEAN * np.nanmedian(apart, axis=(0, 1, 2)) if apart.size else 0
    offset = np.minimum(np.nanquantile(median_of_seen(blocks), 0.1, axis=(0, 1)), explained)
    return np.where(offset < EIGHT_BIT_STEP, 0, offset).astype(np.float32)


def linear_excess(encoded: Picture, deviation: npt.ArrayLike) -> Picture:
    """Return how much linear light noise of a standard deviation adds on the mean, at sRGB values.

    Linear light f is convex in sRGB values, so the mean of f(v + n) exceeds f(v) by half the variance of n times the
    second derivative of f. Taken at noisy values, the term has the same mean, up to fourth order in the noise.
    """
    # the second derivative of the curve of `srgb_to_linear`
    curvature = 2.4 * 1.4 / 1.055**2 * ((np.maximum(encoded, 0.04) + 0.055) / 1.055) ** 0.4
    excess = np.where(encoded > 0.04, 0.5 * np.square(deviation) * curvature, 0)
    return np.asarray(excess, np.float32)


def linear_per_srgb(encoded: Picture) -> Picture:
    """Return the derivative of linear light at sRGB values, which turns their noise into linear noise."""
    half = EIGHT_BIT_STEP / 2
    return (srgb_to_linear(encoded + half) - srgb_to_linear(encoded - half)) / EIGHT_BIT_STEP


def median_of_seen(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the median along the first axis of what is seen (not NaN); NaN where nothing is."""
    ordered, count = np.sort(values, axis=0), np.maximum(count_of_seen(values), 1)  # NaNs come last
    lower, upper = at_rank(ordered, (count - 1) // 2), at_rank(ordered, count // 2)
    return np.asarray((lower + upper) / np.float32(2), np.float32)


def count_of_seen(values: npt.NDArray[np.float32]) -> npt.NDArray[np.intp]:
    """Return how many values along the first axis are not NaN."""
    return np.asarray(np.count_nonzero(~np.isnan(values), axis=0))


def at_rank(ordered: npt.NDArray[np.float32], rank: npt.NDArray[np.intp]) -> npt.NDArray[np.float32]:
    """Return each pixel's value at its rank, counted from 0, of values ordered along the first axis."""
    return np.asarray(np.take_along_axis(ordered, rank[None], 0)[0])


def gain_of(picture: Picture, background: Picture) -> Picture:
    """Return how many times brighter a picture is than its background, (3,); ones if that is not measurable or visible.

    Both are linear (rows, columns, 3) and `small`, so that their noise does not count.
    """
    gains = np.ones(3, np.float32)
    usable = _usable(background) & _usable(picture)
    if usable.mean() < MIN_USABLE_FRACTION:
        return gains
    ratios = np.log(picture[usable] / background[usable])
    if (brightest_channel(np.abs(ratios)) < SAME).mean() >= UNCHANGED:
        return gains
    middle, spread = zip(*(_shorth(ratios[:, channel]) for channel in range(3)), strict=True)
    if max(spread) > SPREAD:
        return gains
    return np.exp(np.array(middle, np.float32))


def shows_exposure(background: Picture) -> bool:
    """Return whether enough of a linear background (rows, columns, 3) is usable to measure gains against it."""
    return bool(_usable(background).mean() >= MIN_USABLE_FRACTION)


def small(picture: Picture) -> Picture:
    """Return a picture at the size that gains are measured at."""
    rows, columns = picture.shape[:2]
    return area_average(picture, *reduced_size(columns, rows, COMPARED_SIDE))


def sample_gains(samples: npt.NDArray[np.float32]) -> Picture:
    """Return gains (frames, 3) of small linear pictures (frames, rows, columns, 3) to their median; NaN is unseen."""
    gains = np.ones((len(samples), 3), np.float32)
    for _ in range(3):  # frames of one exposure have a more certain median than those of several
        reference = median_of_seen(samples / gains[:, None, None])
        before, gains = gains, np.stack([gain_of(sample, reference) for sample in samples])
        if (gains == before).all():  # converged
            break
    return gains


def _usable(picture: Picture) -> npt.NDArray[np.bool_]:
    return np.asarray((brightest_channel(-picture) < -USABLE[0]) & (brightest_channel(picture) < USABLE[1]))


def _shorth(values: npt.NDArray[np.float32]) -> tuple[float, float]:
    """Middle and width of the shortest interval that holds the fraction `AGREEING` of the values."""
    ordered = np.sort(values)
    count = max(1, int(AGREEING * len(ordered)))
    widths = ordered[count - 1 :] - ordered[: len(ordered) - count + 1]
    first = int(widths.argmin())
    return float(np.median(ordered[first : first + count])), float(widths[first])
