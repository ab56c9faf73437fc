"""The noise of a clip: sensor and compression together, measured on frames spread over it.

Noise is measured in sRGB values, where that of cameras and codecs is about the same at every brightness.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, linear_to_srgb, srgb_to_linear

EIGHT_BIT_STEP = np.float32(1 / 255)
"""One step of 8 bit video, in sRGB values: the least noise that a clip is taken to have."""

NOISE_STRIDE = 3
"""Pixels from one row or column to the next where noise is measured: a ninth of the picture is enough for a median."""

_FIXED_POINT = 8192
"""Steps of a stored sample in one unit of sRGB: 16 bits hold values up to 8."""

_SAMPLE_BYTES = 512 * 2**20
"""Memory for the stored samples of a clip: 32 frames of 1080p fit."""


def sample_frames(clip: Clip, count: int, stride: int = 1) -> npt.NDArray[np.uint16]:
    """Return frames spread evenly over a clip, in fixed point; `decode_samples` reads them.

    Parameters
    ----------
    clip
        The footage.
    count
        How many frames; fewer are returned of a shorter clip, and of pictures so large that they need too much memory.
    stride
        Of each frame every ``stride``-th row and column is taken.

    Returns
    -------
    (frames, rows, columns, 3) uint16
        sRGB values.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    width, height = clip.size
    most = max(3, stride**2 * _SAMPLE_BYTES // (width * height * 6))
    numbers = clip.spread(min(count, most))
    rows, columns = len(range(0, height, stride)), len(range(0, width, stride))
    samples = np.empty((len(numbers), rows, columns, 3), np.uint16)
    for sample, number in zip(samples, numbers, strict=True):
        encoded = linear_to_srgb(clip.frame(number)[::stride, ::stride])
        sample[...] = np.clip(encoded * _FIXED_POINT + 0.5, 0, 65535)
    return samples


def decode_samples(samples: npt.NDArray[np.uint16]) -> Picture:
    """Return what `sample_frames` stored as float32 sRGB values."""
    return samples.astype(np.float32) / np.float32(_FIXED_POINT)


def temporal_noise(frames: Picture) -> Picture:
    """Return the noise of static pixels, in sRGB values, shape (3,).

    It is the median over the pixels of the deviation over time, which smoke over less than half of the picture does
    not disturb. Differences of successive frames would be too small: a codec repeats a static block for some frames
    and then replaces it.

    Parameters
    ----------
    frames : (frames, rows, columns, 3)
        sRGB values.
    """
    deviation = frames.std(axis=0).reshape(-1, 3)
    noise: Picture = np.maximum(np.median(deviation, axis=0), EIGHT_BIT_STEP).astype(np.float32)
    return noise


def noise_of_clear_pixels(frames: Picture, background: Picture) -> Picture:
    """Return the noise of the tenth of the pixels that stay nearest to a known background, in sRGB values, shape (3,).

    Smoke may pass over the other nine tenths.

    Parameters
    ----------
    frames : (frames, rows, columns, 3)
        sRGB values.
    background : (rows, columns, 3)
        sRGB values.
    """
    deviation = np.sqrt(np.mean((frames - background) ** 2, axis=0)).reshape(-1, 3)
    noise: Picture = np.maximum(np.quantile(deviation, 0.1, axis=0), EIGHT_BIT_STEP).astype(np.float32)
    return noise


def linear_per_srgb(encoded: Picture) -> Picture:
    """Return the derivative of linear light by the sRGB value, at sRGB values: what turns their noise into linear."""
    half = EIGHT_BIT_STEP / 2
    return (srgb_to_linear(encoded + half) - srgb_to_linear(encoded - half)) / EIGHT_BIT_STEP
