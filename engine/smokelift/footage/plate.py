"""What a camera sees without smoke: one picture for the whole clip, or one for each frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from smokelift.footage.clip import Clip
from smokelift.footage.exposure import gain_of, small
from smokelift.footage.images import Picture, area_average, linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import (
    Noise,
    block_means,
    clipped_black,
    lasting_noise,
    linear_per_srgb,
    noise_about,
    some_blocks,
)

NOISE_FRAMES = 32
"""Frames that the noise before a known background is measured on."""

CLIPPED_LEVEL = np.float32(0.1)
"""Lasting part of white noise that is clipped at black: so little is known of the mean that is left, since
it depends on how the file rounds."""


@dataclass(frozen=True, eq=False)
class Plate:
    """What the camera sees without smoke.

    Attributes
    ----------
    image : (rows, columns, 3)
        Linear.
    confidence : (rows, columns)
        From 0 (filled from neighbours) to 1 (seen clear in many frames).
    noise
        Of the camera's pictures.
    errors : (3, 3)
        Covariance of the colours' errors where it is filled in, linear; 0 if nothing is known of them.
    """

    image: Picture
    confidence: Picture
    noise: Noise
    errors: Picture = field(default_factory=lambda: np.zeros((3, 3), np.float32))

    def at(self, frame: int) -> Plate:
        """Return the plate of a frame: this one, since the background stands still."""
        return self

    def through(self, cut: Callable[[Picture], Picture], pixels: float = 1.0) -> Plate:
        """Return the plate of a part of the picture, or of a smaller one.

        Parameters
        ----------
        cut
            Makes the part from a picture (rows, columns, ...).
        pixels
            Of which each new one is the mean.
        """
        return Plate(cut(self.image), cut(self.confidence), self.noise.averaged(pixels), self.errors)


@dataclass(frozen=True, eq=False)
class ChangingPlate:
    """A background that differs from frame to frame, behind a camera that moves or before a scene that does.

    Attributes
    ----------
    whole
        Makes that of a whole frame of the footage, counted from 0.
    noise
        Of the footage.
    files
        What it is read from.
    cuts
        What makes the part of the picture that is asked for, with the pixels of which each new one is the mean, applied
        in this order.
    """

    whole: Callable[[int], Plate]
    noise: Noise
    files: tuple[Path, ...] = ()
    cuts: tuple[tuple[Callable[[Picture], Picture], float], ...] = ()

    def at(self, frame: int) -> Plate:
        """Return the plate of a frame of the footage, counted from 0.

        Raises
        ------
        ClipError
            If its picture cannot be read.
        """
        plate = replace(self.whole(frame), noise=self.noise)
        for cut, pixels in self.cuts:
            plate = plate.through(cut, pixels)
        return plate

    def through(self, cut: Callable[[Picture], Picture], pixels: float = 1.0) -> ChangingPlate:
        """Return the plates of a part of the picture, or of a smaller one; see `Plate.through`."""
        return replace(self, cuts=(*self.cuts, (cut, pixels)))


class Plates(Protocol):
    """The background of every frame of a clip."""

    @property
    def noise(self) -> Noise:
        """Noise of the clip's pictures."""

    def at(self, frame: int) -> Plate:
        """Return the plate of a frame, counted from 0."""

    def through(self, cut: Callable[[Picture], Picture], pixels: float = 1.0) -> Plates:
        """Return the plates of a part of the picture, or of a smaller one; see `Plate.through`."""


def known_plate(background: npt.ArrayLike, clip: Clip, sample_count: int = NOISE_FRAMES) -> Plate:
    """Return the plate of a background that is known, with the clip's noise.

    Noise that is clipped at black makes a black background brighter on the mean: the plate is as bright.

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
        raise ValueError(f"a background must be a finite color or RGB picture, not of shape {linear.shape}")
    image = area_average(linear, width, height)
    confidence = np.ones((height, width), np.float32)
    deviations, blocks = _deviations(Plate(image, confidence, lasting_noise(0.0)), clip, sample_count)
    given = linear_to_srgb(image)
    raised = np.maximum(given, clipped_black(deviations, blocks)) - given
    if raised.any():
        image = srgb_to_linear(given + raised)
        deviations, blocks = deviations - some_blocks(raised), blocks - block_means(raised[None])
    noise = noise_about(deviations, blocks)
    if raised.any():
        noise = Noise(noise.white, np.maximum(noise.lasting, CLIPPED_LEVEL * noise.white))
    return Plate(image, confidence, noise)


def changing_plate(plates: Clip, clip: Clip, sample_count: int = NOISE_FRAMES) -> ChangingPlate:
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
            "picture for every frame of the clip, or a color, as background."
        )
    width, height = clip.size
    known, no_noise = np.ones((height, width), np.float32), lasting_noise(0.0)

    def whole(frame: int) -> Plate:
        return Plate(area_average(plates.frame(clip.first + frame), width, height), known, no_noise)

    silent = ChangingPlate(whole, no_noise, plates.files)
    return replace(silent, noise=noise_before(silent, clip, sample_count))


def noise_before(plates: Plates, clip: Clip, sample_count: int = NOISE_FRAMES) -> Noise:
    """Return the noise of a clip before backgrounds that are known, from so many of its frames."""
    return noise_about(*_deviations(plates, clip, sample_count))


def _deviations(plates: Plates, clip: Clip, count: int) -> tuple[Picture, Picture]:
    """How a clip differs from backgrounds that are known, as `noise_about` takes it.

    What a mask hides is not a number.
    """
    single, blocks = [], []
    encoded = lru_cache(maxsize=1)(lambda plate: linear_to_srgb(plate.image))  # of a camera that stands still, once
    for number in clip.spread(count):
        plate, stored = plates.at(number), clip.stored(number)
        seen = clip.as_seen(number, stored.linear())
        gains = gain_of(small(seen), small(plate.image))
        even = stored.through(linear_to_srgb) if (gains == 1).all() else linear_to_srgb(seen / gains)
        deviation = clip.as_seen(number, even) - encoded(plate)
        single.append(some_blocks(deviation))
        blocks.append(block_means(deviation[None])[0])
    return np.stack(single), np.stack(blocks)


def noise_at(picture: npt.ArrayLike, plate: Plate) -> Picture:
    """Return the noise of each pixel of a picture in linear light, where it grows with brightness.

    Parameters
    ----------
    picture : (rows, columns, 3)
        Linear.
    plate
        For its noise, which is even in sRGB values.

    Returns
    -------
    (rows, columns, 3) float32
        Standard deviation.
    """
    return plate.noise.total * linear_per_srgb(linear_to_srgb(np.asarray(picture, np.float32)))
