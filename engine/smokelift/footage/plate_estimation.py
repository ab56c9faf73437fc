"""The clean plate of a clip from its frames alone.

Assumed: camera and background stand still, and a pixel is clear in some share of the frames. A clear pixel keeps
returning to one value within the noise; smoke moves and spreads its values widely. So the plate is, pixel by pixel,
the mode of the samples: the value with the most of them in a window as wide as the noise.

Smoke that stays for long makes a second, sometimes larger, mode. Where smoke only brightens what is behind it (white
smoke before a darker wall), the darkest well-supported value is taken instead, and where it only darkens, the
brightest. Which of these holds is measured on the clip.

A pixel that is never clear (over the source, as a rule) is unknown. Its confidence is near 0 and it is filled smoothly
from its neighbours. What never moves, a nozzle or a perfectly steady jet, is background.

A camera that moves shows another part of the background in every frame, so a pixel has no value of its own: the
background has to be of one colour, or known frame by frame.

How much the constants matter: docs/experiments/background-plate.md.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average
from smokelift.footage.matte import matte
from smokelift.footage.noise import NOISE_STRIDE, decode_samples, sample_frames, temporal_noise
from smokelift.footage.plate import Plate, encoded_noise

MODE_WINDOW = 6.0
"""Width of the window of samples around a value, in units of noise: plus and minus three standard deviations."""

ONE_SIDED = 0.9
"""Share of the deviations to one side from which on smoke is taken to only brighten (or darken) its background."""

WELL_SUPPORTED = 0.35
"""Samples in a value's window, as a share of the mode's, from which on the value may be the background."""

CLEAR_RUN = (2, 6)
"""Successive samples at the chosen value: a pixel is never clear up to the first number, certainly from the second."""

CLEAR_SHARE = (0.3, 0.6)
"""The same as shares of all samples, for clips that have few."""

ONE_COLOUR_NOISE = np.float32(6 / 255)
"""Most noise of a background of one colour, in sRGB values: a pixel that varies more while the camera moves sees more
than one colour."""


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
    samples = sample_frames(clip, sample_count)
    noise = temporal_noise(decode_samples(samples[:, ::NOISE_STRIDE, ::NOISE_STRIDE]))
    window = MODE_WINDOW * float(np.sqrt((noise**2).mean()))
    sign = _smoke_sign(samples[:, ::4, ::4], window)
    height, width = samples.shape[1:3]
    image = np.empty((height, width, 3), np.float32)
    run = np.empty((height, width), np.int16)
    for row in range(0, height, 64):  # in bands, for the sake of memory
        band = slice(row, row + 64)
        image[band], run[band] = _clear_value(samples[:, band], window, sign)
    low, high = (min(bound, share * len(samples)) for bound, share in zip(CLEAR_RUN, CLEAR_SHARE, strict=True))
    # A clear speck amid smoke is an accident of the samples.
    run = np.minimum(run, ndimage.median_filter(run, 7))
    confidence = np.clip((run - low) / (high - low), 0.0, 1.0)
    # What is less than half certain is filled as a whole: a part of it would spread its smoke.
    known = np.clip(2.0 * confidence - 1.0, 0.0, 1.0)
    return Plate.from_srgb(_filled(image, known), confidence.astype(np.float32), noise)


def one_colour(plate: Plate) -> tuple[float, float, float] | None:
    """Return the linear colour of a plate that was estimated from a moving camera, or None if it has more than one."""
    known = plate.confidence > 0.5
    if known.mean() < 0.5 or encoded_noise(plate).max() > ONE_COLOUR_NOISE:
        return None
    red, green, blue = (float(v) for v in np.median(plate.image[known], axis=0))
    colour = np.broadcast_to(np.array([red, green, blue], np.float32), plate.image.shape)
    differs = matte(plate.image, Plate(colour, np.ones_like(plate.confidence), plate.noise)).mask
    return None if (differs & known).any() else (red, green, blue)


def _supports(ordered: Picture, window: float) -> npt.NDArray[np.int16]:
    """Return how many samples lie from each one up to ``window`` above it; ordered along the first axis."""
    counts = np.ones(ordered.shape, np.int16)
    for lag in range(1, len(ordered)):
        counts[:-lag] += ordered[lag:] - ordered[:-lag] <= window
    return counts


def _smoke_sign(samples: npt.NDArray[np.uint16], window: float) -> int:
    """Return 1 if smoke only brightens the background, -1 if it only darkens it, else 0."""
    grey = decode_samples(samples).mean(axis=-1)
    ordered = np.sort(grey, axis=0)
    counts = _supports(ordered, window)
    best = counts.argmax(axis=0)[None]
    mode = np.take_along_axis(ordered, best, axis=0) + 0.5 * window
    # Where most samples agree, the mode is the background for certain; small deviations may be drift.
    deviation = np.where(counts.max(axis=0) > 0.6 * len(grey), grey - mode, 0.0)
    brighter, darker = (int((sign * deviation > 2.0 * window).sum()) for sign in (1, -1))
    if brighter > ONE_SIDED * (brighter + darker):
        return 1
    return -1 if darker > ONE_SIDED * (brighter + darker) else 0


def _clear_value(samples: npt.NDArray[np.uint16], window: float, sign: int) -> tuple[Picture, npt.NDArray[np.int16]]:
    """Return the background value of each pixel, in sRGB, and how many samples in a row have it at most."""
    colours = decode_samples(samples)
    grey = colours.mean(axis=-1)
    ordered = np.sort(grey, axis=0)
    counts = _supports(ordered, window)
    supported = counts >= WELL_SUPPORTED * counts.max(axis=0)
    if sign > 0:
        chosen = supported.argmax(axis=0)
    elif sign < 0:
        chosen = len(supported) - 1 - supported[::-1].argmax(axis=0)
    else:
        chosen = counts.argmax(axis=0)
    centre = np.take_along_axis(ordered, chosen[None], axis=0) + 0.5 * window
    for _ in range(3):  # the window starts at a sample; mean shift settles it around the mean of its samples
        inside = np.abs(grey - centre) <= 0.5 * window * 1.001
        number = np.maximum(inside.sum(axis=0), 1)
        centre = (grey * inside).sum(axis=0, keepdims=True) / number
    value = np.einsum("tyxc,tyx->yxc", colours, inside.astype(np.float32)) / number[..., None]
    run = longest = np.zeros(grey.shape[1:], np.int16)
    for hit in inside:
        run = (run + 1) * hit
        longest = np.maximum(longest, run)
    return value.astype(np.float32), longest


def _filled(image: Picture, confidence: Picture) -> Picture:
    """Blend pixels of low confidence with the smooth continuation of their surroundings.

    The push-pull algorithm (Gortler et al., "The lumigraph", 1996): averages weighted by confidence over ever larger
    blocks; each level keeps what it knows and takes the rest from the next coarser one.
    """
    height, width = confidence.shape
    weight: Picture = confidence[..., None]
    if min(height, width) == 1 or float(confidence.min()) >= 1.0:
        return image
    small = ((width + 1) // 2, (height + 1) // 2)
    total = area_average(weight, *small)
    mean = area_average(image * weight, *small) / np.maximum(total, 1e-6)
    # A block of which a quarter is known is known: its mean is as good as any.
    coarse = _filled(mean, np.minimum(4.0 * total[..., 0], 1.0))
    blend: Picture = image * weight + area_average(coarse, width, height) * (np.float32(1.0) - weight)
    return blend
