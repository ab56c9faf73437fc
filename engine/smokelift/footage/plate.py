"""What a camera sees without smoke: one picture for the whole clip, or one for each frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import (
    NOISE_STRIDE,
    decode_samples,
    linear_per_srgb,
    noise_of_clear_pixels,
    sample_frames,
    temporal_noise,
)

SMOKE_TO_NOISE = 3.0
"""Deviation over time, in units of the clear pixels' noise, above which it is smoke and not noise
(docs/experiments/background-plate.md)."""


@dataclass(frozen=True, eq=False)
class Plate:
    """What the camera sees without smoke.

    Attributes
    ----------
    image : (rows, columns, 3)
        Linear.
    confidence : (rows, columns)
        From 0 (filled from neighbours) to 1 (seen clear in many frames).
    noise : (3,)
        Standard deviation of a static pixel, sensor and compression together, in linear light at the plate's median
        brightness; at least one step of 8 bit video.
    """

    image: Picture
    confidence: Picture
    noise: Picture

    @classmethod
    def from_srgb(cls, encoded: Picture, confidence: Picture, noise: Picture) -> Plate:
        """Return the plate of a picture and a noise that are given in sRGB values."""
        linear_noise = noise * linear_per_srgb(np.median(encoded, axis=(0, 1)))
        return cls(srgb_to_linear(encoded), confidence, linear_noise.astype(np.float32))

    def at(self, frame: int) -> Plate:
        """Return the plate of a frame: this one, since the background stands still."""
        return self

    def through(self, cut: Callable[[Picture], Picture]) -> Plate:
        """Return the plate of a part of the picture, or of a smaller one.

        Parameters
        ----------
        cut
            Makes the part from a picture (rows, columns, ...).
        """
        return Plate(cut(self.image), cut(self.confidence), self.noise)


@dataclass(frozen=True, eq=False)
class ChangingPlate:
    """A background that is known frame by frame, behind a camera that moves or before a scene that does.

    Attributes
    ----------
    clip
        A clean plate a frame.
    first
        Its frame that is behind frame 0 of the footage.
    size
        Width and height of the footage in pixels.
    noise : (3,)
        Of the footage, in sRGB values.
    cuts
        What makes the part of the picture that is asked for, applied in this order.
    """

    clip: Clip
    first: int
    size: tuple[int, int]
    noise: Picture
    cuts: tuple[Callable[[Picture], Picture], ...] = ()

    def encoded(self, frame: int) -> Picture:
        """Return the whole background of a frame in sRGB values, (rows, columns, 3)."""
        return linear_to_srgb(area_average(self.clip.frame(self.first + frame), *self.size))

    def at(self, frame: int) -> Plate:
        """Return the plate of a frame of the footage, counted from 0.

        Raises
        ------
        ClipError
            If its picture cannot be read.
        """
        width, height = self.size
        plate = Plate.from_srgb(self.encoded(frame), np.ones((height, width), np.float32), self.noise)
        for cut in self.cuts:
            plate = plate.through(cut)
        return plate

    def through(self, cut: Callable[[Picture], Picture]) -> ChangingPlate:
        """Return the plates of a part of the picture, or of a smaller one; see `Plate.through`."""
        return replace(self, cuts=(*self.cuts, cut))


Plates = Plate | ChangingPlate
"""The background of every frame of a clip: ``plates.at(frame)`` is the plate of one."""


def known_plate(background: npt.ArrayLike, clip: Clip, sample_count: int = 32) -> Plate:
    """Return the plate of a background that is known, with the clip's noise.

    Parameters
    ----------
    background
        A linear colour, shape (3,), or a picture, shape (rows, columns, 3), resized to the clip if need be.
    clip
        For its size and its noise.
    sample_count
        Frames that the noise is measured on.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    ValueError
        If the background is neither, or not finite.
    """
    width, height = clip.size
    linear = np.asarray(background, np.float32)
    if linear.shape == (3,):
        linear = np.broadcast_to(linear, (height, width, 3))
    if linear.ndim != 3 or linear.shape[2] != 3 or not np.isfinite(linear).all():
        raise ValueError(f"a background must be a finite colour or RGB picture, not of shape {linear.shape}")
    encoded = linear_to_srgb(area_average(linear, width, height))
    frames = decode_samples(sample_frames(clip, sample_count, NOISE_STRIDE))
    temporal = temporal_noise(frames)
    clear = noise_of_clear_pixels(frames, encoded[::NOISE_STRIDE, ::NOISE_STRIDE])
    # Where smoke passes over most of the picture, most of what changes over time is smoke.
    noise = np.where(temporal > SMOKE_TO_NOISE * clear, clear, temporal)
    return Plate.from_srgb(encoded, np.ones((height, width), np.float32), noise)


def changing_plate(plates: Clip, clip: Clip, sample_count: int = 32) -> ChangingPlate:
    """Return the plates of a background that is known frame by frame, with the clip's noise.

    Parameters
    ----------
    plates
        With a frame for every one of the clip's file, resized to the clip if need be.
    clip
        Its noise is what differs from the plates.
    sample_count
        Frames that the noise is measured on.

    Raises
    ------
    ValueError
        If there are too few plates.
    ClipError
        If a frame cannot be read.
    """
    last = clip.first + len(clip) - 1
    if last >= len(plates):
        raise ValueError(
            f"{plates.path}: has {len(plates)} of the frames 0 to {last} that are needed; give a clean plate with a "
            "picture for every frame of the clip, or a color, in [background]."
        )
    silent = ChangingPlate(plates, clip.first, clip.size, np.zeros(3, np.float32))
    stride = slice(None, None, NOISE_STRIDE)
    deviations = [
        (linear_to_srgb(clip.frame(number)) - silent.encoded(number))[stride, stride]
        for number in clip.spread(sample_count)
    ]
    return replace(silent, noise=temporal_noise(np.stack(deviations)))


def encoded_noise(plate: Plate) -> Picture:
    """Return the noise of a plate in sRGB values, where it is the same at every brightness, shape (3,)."""
    return plate.noise / linear_per_srgb(np.median(linear_to_srgb(plate.image), axis=(0, 1)))


def noise_at(picture: npt.ArrayLike, plate: Plate) -> Picture:
    """Return the noise of each pixel of a picture in linear light, where it grows with brightness.

    Parameters
    ----------
    picture : (rows, columns, 3)
        Linear.
    plate
        For its noise, which is that at its median brightness.

    Returns
    -------
    (rows, columns, 3) float32
        Standard deviation.
    """
    return encoded_noise(plate) * linear_per_srgb(linear_to_srgb(np.asarray(picture, np.float32)))
