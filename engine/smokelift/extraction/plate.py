"""What a camera sees without smoke, and clips matched to it: at its exposure, without the light that noise adds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import is_video
from smokelift.footage.images import Picture, area_average, brightest_channel, linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import (
    EIGHT_BIT_STEP,
    Noise,
    clipped_black,
    gain_of,
    lasting_noise,
    linear_excess,
    linear_per_srgb,
    noise_about,
    noise_block_means,
    small,
    some_blocks,
)
from smokelift.footage.video import median_quantizer

CLIPPED_LEVEL = np.float32(0.1)
"""Smallest lasting noise over white noise clipped at black, whose mean depends on how the file rounds."""

NOISE_FRAMES = 32
"""Frames that the noise before a known background is measured on, and its edges: a median needs no more."""

MIDDLE = np.full(3, 0.5, np.float32)
"""sRGB values at which the brightening by noise is judged."""

UNCOVERED = 5
"""Frames whose median is the background where a mask hides all of them."""

FINEST, LARGEST_FINEST = 2.0, 8.0
"""Pixels along the finest detail of a plate that a codec leaves of it behind thin smoke, at `FINE_QUANTIZER` and less,
and the most that are taken (docs/experiments/extraction.md)."""

FINE_QUANTIZER, COARSENING = 18.0, 10.0
"""Quantizer of H.264 at which a clip is hard to tell from its original, and how much more doubles these pixels, whose
number grows as the quantizer's step to the power of .6 (docs/experiments/extraction.md)."""

USUAL_QUANTIZER = 23.0
"""Quantizer of a video that does not say its own: x264's default, and the median of 28 public clips."""


@dataclass(frozen=True, eq=False)
class Plate:
    """What the camera sees without smoke: one picture, or one for each frame of a clip."""

    image: Picture
    """(rows, columns, 3): linear; that of the first frame if it changes."""
    confidence: Picture
    """(rows, columns): from 0 (filled from neighbors) to 1 (seen clear in many frames)."""
    noise: Noise
    """Noise of the clip's pictures."""
    errors: Picture = field(default_factory=lambda: np.zeros((3, 3), np.float32))
    """(3, 3): covariance of the linear color errors where it is filled in; 0 if they are unknown."""
    images: Callable[[int], Picture] | None = None
    """What makes the image of a frame, counted from 0, behind a camera that moves or before a scene that changes; it
    raises ClipError if it cannot. None if the background stands still."""
    files: tuple[Path, ...] = ()
    """What such images are read from."""
    finest: float = FINEST
    """Pixels along the finest detail of it that the clip keeps behind smoke; see `finest_detail`."""

    def at(self, frame: int) -> Plate:
        """Return the plate of a frame, counted from 0, which has one image."""
        return self if self.images is None else replace(self, image=self.images(frame), images=None)

    def through(self, cut: Callable[[Picture], Picture], pixels: float = 1.0) -> Plate:
        """Return the plate of a part of the picture, or of a smaller one.

        ``cut`` makes that from a picture (rows, columns, ...); each new pixel is the mean of ``pixels`` old ones.
        """
        of, noise = self.images, self.noise.averaged(pixels)
        images = None if of is None else lambda frame: cut(of(frame))
        return replace(self, image=cut(self.image), confidence=cut(self.confidence), noise=noise, images=images)

    def gain(self, frame: int, picture: Picture) -> Picture:
        """Return how many times brighter a frame is, (3,), by its `small` linear picture."""
        return gain_of(picture, self.at(frame)._small)

    @cached_property
    def _small(self) -> Picture:
        return small(self.image)


def resized(plate: Plate, size: tuple[int, int]) -> Plate:
    """Return a plate reduced to a size (columns, rows)."""
    columns, rows = plate.image.shape[1::-1]
    return plate.through(lambda part: area_average(part, *size), columns * rows / (size[0] * size[1]))


def finest_detail(clip: Clip) -> float:
    """Return the pixels along the finest detail of a given plate that a clip's codec leaves behind thin smoke."""
    if not is_video(clip.path):
        return FINEST
    quantizer = median_quantizer(clip.path)
    coarser = (USUAL_QUANTIZER if quantizer is None else quantizer) - FINE_QUANTIZER
    return float(np.clip(FINEST * 2 ** (coarser / COARSENING), FINEST, LARGEST_FINEST))


def known_plate(background: npt.ArrayLike | Clip, clip: Clip, *, filmed: bool = False) -> tuple[Plate, Clip]:
    """Return the plate, with the clip's noise, of a known background, and the clip at its exposure.

    The background is a linear color (3,), a picture (rows, columns, 3), or a clip with one for each frame of the clip's
    file; pictures are resized to the clip if need be. Unless they are ``filmed``, made of the file's own frames, their
    colors become as coarse as the file holds them. Noise that is clipped at black brightens a black one on the mean,
    and so its plate. ClipError is raised if a frame cannot be read, ValueError if the background is none of these, not
    finite, or has too few frames.
    """
    (width, height), last = clip.size, clip.numbers[-1]
    known, unmeasured = np.ones((height, width), np.float32), lasting_noise(0.0)
    if isinstance(background, Clip):
        if last >= len(background):
            raise ValueError(
                f"{background.path}: has {len(background)} of the frames 0 to {last} that are needed; give a clean "
                "plate with a picture for every frame of the clip, or a color, as background."
            )

        @lru_cache(maxsize=1)  # each part of a frame's work asks for it
        def images(frame: int) -> Picture:
            return clip.as_held(area_average(background.frame(clip.numbers.start + frame), width, height))

        image = images(0)
        plate = Plate(image, known, unmeasured, images=images, files=background.files)
    else:
        linear = np.asarray(background, np.float32)
        color = linear.shape == (3,)
        if not (color or (linear.ndim == 3 and linear.shape[2] == 3)) or not np.isfinite(linear).all():
            raise ValueError(f"a background must be a finite color or RGB picture, not of shape {linear.shape}")
        image = np.tile(linear, (height, width, 1)) if color else area_average(linear, width, height)
        plate = Plate(image if color or filmed else clip.as_held(image), known, unmeasured)
    exposed = clip.exposed(plate.gain)
    return _measured(plate, np.abs(plate.image - image), exposed), exposed


def _measured(plate: Plate, reach: Picture, clip: Clip) -> Plate:
    """Return a plate as a clip at its exposure shows it, with the clip's noise.

    Coarse colors have changed the plate by ``reach`` (rows, columns, 3). Beside a saturated edge a codec does not hold
    even these. There each pixel goes on towards the frame that is nearest to it, by that much at most.
    """
    encoded = lru_cache(maxsize=1)(lambda plate: linear_to_srgb(plate.image))  # once if the plate is always the same
    edge = (reach > EIGHT_BIT_STEP * linear_per_srgb(encoded(plate))).any(-1)
    nearest, distance = np.zeros_like(reach[edge]), np.full(np.count_nonzero(edge), np.inf)
    single, blocks = [], []
    for number in clip.spread(NOISE_FRAMES):
        shown, behind = clip.stored(number), plate.at(number)
        deviation = clip.as_seen(number, shown.through(linear_to_srgb)) - encoded(behind)
        if edge.any():
            away = shown.cut(lambda values: values[edge][None]).linear()[0] - plate.image[edge]
            apart = brightest_channel(np.abs(away))
            closer = (apart < distance) & np.isfinite(deviation[..., 0][edge])  # never where it is hidden
            nearest[closer], distance[closer] = away[closer], apart[closer]
        single.append(some_blocks(deviation))
        blocks.append(noise_block_means(deviation[None])[0])
    samples = np.stack(single), np.stack(blocks)
    if plate.images is not None:
        return replace(plate, noise=noise_about(*samples))
    held = encoded(plate)
    image = plate.image.copy()
    image[edge] += np.clip(nearest, -reach[edge], reach[edge])
    given = linear_to_srgb(image)
    samples = _less(samples, given - held)
    raised = np.maximum(given, clipped_black(*samples)) - given
    if not raised.any():
        return replace(plate, image=image, noise=noise_about(*samples))
    noise = noise_about(*_less(samples, raised))
    shared = np.maximum(noise.lasting, CLIPPED_LEVEL * noise.white)
    return replace(plate, image=srgb_to_linear(given + raised), noise=replace(noise, shared=shared))


def _less(samples: tuple[Picture, Picture], change: Picture) -> tuple[Picture, Picture]:
    """Samples of deviations, as `noise_about` takes them, from a background that is changed, in sRGB values."""
    single, blocks = samples
    return single - some_blocks(change), blocks - noise_block_means(change[None])


def noise_at(picture: npt.ArrayLike, plate: Plate) -> Picture:
    """Return the standard deviation, linear, of the noise of each value of a linear picture (rows, columns, 3).

    The plate's noise is even in sRGB values, so in linear light it grows with brightness.
    """
    return plate.noise.total * linear_per_srgb(linear_to_srgb(np.asarray(picture, np.float32)))


def without_noise_light(clip: Clip, noise: Noise) -> Clip:
    """Return a clip without the light that its noise adds to means (`linear_excess`).

    A clip that noise brightens by less than rounding to 8 bits may is returned as it is. Before black too little is
    taken off: noise is measured where there is no smoke, and there it is clipped.
    """
    if (linear_excess(MIDDLE, noise.total) <= 0.5 * EIGHT_BIT_STEP * linear_per_srgb(MIDDLE)).all():
        return clip

    def lessened(_: int, picture: Picture) -> Picture:
        return np.maximum(picture - linear_excess(linear_to_srgb(picture), noise.total), 0)

    return clip.changed(lessened)


def cleared(clip: Clip, plate: Plate) -> Clip:
    """Return a clip at its plate's exposure that shows the plate where a mask hides it."""
    return clip if clip.mask is None else shown_behind(clip, plate, clip.as_seen)


def shown_behind(clip: Clip, plate: Plate, visible: Callable[[int, Picture], Picture]) -> Clip:
    """Return a clip at its plate's exposure that shows the plate where ``visible`` makes it not a number."""

    def change(number: int, picture: Picture) -> Picture:
        shown = visible(number, picture)
        return np.where(np.isnan(shown), plate.at(number).image, shown)

    return clip.changed(change)


def uncovered(plate: Plate, clip: Clip) -> Plate:
    """Return a background that shows what the clip itself shows where a mask hides all frames.

    That is no smoke, so it may stand behind the result.
    """
    mask, numbers = clip.mask, clip.spread(UNCOVERED)
    if mask is None:
        return plate
    hidden = ~np.any([mask.seen(clip.numbers[number], *clip.size) for number in numbers], axis=0)
    if not hidden.any():
        return plate
    filmed, image = clip.as_filmed(), plate.image.copy()
    image[hidden] = np.median([filmed.frame(number)[hidden] / clip.gain(number) for number in numbers], axis=0)
    return replace(plate, image=image)
