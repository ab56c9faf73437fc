"""The background of large pictures: found on reduced ones, and made fine on whole ones.

Which pixels show the background, and in which frames, is smooth in the picture as smoke is. It shows on some hundred
pixels along a side, for which the lengths in pixels of `plate_estimation` are chosen (docs/experiments/background.md).
What the background is there, whole frames then tell to the last pixel: their mean where and when they are clear. Where
they never are, the reduced background is continued as ever, and the detail of the mean is given its contrast back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.footage.backdrop import backdrop_plate
from smokelift.footage.behind_smoke import DETAIL, MOST_DETAIL
from smokelift.footage.clip import Clip
from smokelift.footage.evidence import GLIMPSE, are_large, linear
from smokelift.footage.exposure import sample_gains, small
from smokelift.footage.images import Edges, Picture, area_average, linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import (
    BLOCK,
    BLOCKS_APART,
    SMOKE_TO_NOISE,
    Noise,
    as_samples,
    decode_samples,
    encode_sample,
    even_out,
    linear_samples,
    some_blocks,
)
from smokelift.footage.plate import Plate
from smokelift.footage.plate_estimation import clear_picture, clip_noise, seen_of

COARSER = 2
"""Pixels of a glimpse along one of the reduced pictures, which have 320 to 480 along the longer side then."""

SAMPLES = 31
"""Frames of which reduced pictures are taken, as many as of small clips but for one: every second is one of the 16 that
smoke is looked for in."""

WHOLE = slice(None, None, 2)
"""Those of them that are looked at whole."""

AROUND = 16
"""Reduced pixels around what is unknown whose detail bounds that of the unknown."""

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class LargeSamples:
    """Frames of a clip of large pictures, brought to one exposure.

    Attributes
    ----------
    clip
        Camera and background stand still.
    numbers
        Of the frames.
    gains : (frames, 3)
        By how much each is brighter than the others.
    reduced : (frames, rows, columns, 3) uint16
        As of `smokelift.footage.plate_estimation.SteadySamples`, but small.
    seen : (frames, rows, columns) bool, optional
        As there.
    """

    clip: Clip
    numbers: tuple[int, ...]
    gains: Picture
    reduced: npt.NDArray[np.uint16]
    seen: Mask | None = None

    @cached_property
    def noise(self) -> Noise:
        """Of the whole pictures."""
        parts = [
            encode_sample(self.clip.frame_through(number, linear, some_blocks) / gain)
            if (gain != 1).any()
            else self.clip.frame_through(number, encode_sample, some_blocks)
            for number, gain in zip(self.numbers[WHOLE], self.gains[WHOLE], strict=True)
        ]
        seen = seen_of(self.clip, self.numbers[WHOLE], *self.clip.size)
        return clip_noise(np.stack(parts), None if seen is None else np.stack([some_blocks(each) for each in seen]))

    @cached_property
    def _reduced_noise(self) -> Noise:
        return clip_noise(self.reduced, self.seen)

    def backdrop(self) -> Plate | None:
        """Return the plate of a background of one colour, or None if it has more; see `backdrop_plate`."""
        found = backdrop_plate(self.reduced, self._reduced_noise, self.seen)
        if found is None:
            return None
        colour = np.median(found.image.reshape(-1, 3), axis=0)
        own = (found.image != colour).any(-1)
        image = np.tile(colour, (*self.clip.size[::-1], 1))
        if own.any():
            apart = np.abs(decode_samples(self.reduced[WHOLE]) - linear_to_srgb(found.image))
            clear = (apart <= SMOKE_TO_NOISE * self._reduced_noise.total).all(-1)
            fine = self._fine(found.image, own, clear, np.ones(own.shape, np.float32))
            image = np.where(self._spread(own)[..., None], fine, image)
        return Plate(image, np.ones(image.shape[:2], np.float32), self.noise)

    def plate(self) -> Plate:
        """Return the plate of a background of more than one colour."""
        # as many of the whole pictures' pixels as of small ones: smoke has detail of the reduced ones' itself
        found = clear_picture(self.reduced, self._reduced_noise, self.seen, DETAIL / _divisor(self.clip), masked=True)
        image = self._fine(found.image, found.known, found.clear[WHOLE], found.contrast)
        return Plate(image, self._spread(found.known).astype(np.float32), self.noise, found.errors)

    def _fine(self, image: Picture, known: Mask, clear: Mask, contrast: Picture) -> Picture:
        """The whole background (linear) from the reduced one, see `ClearPicture`; ``clear`` is that of whole frames."""
        shown = clear & known
        told = shown.any(0)
        fine = self._mean(np.where(told, shown, True))
        if told.all():
            return fine
        rows, columns = (np.flatnonzero(~told.all(axis)) for axis in (1, 0))
        (top, down), (left, right) = (
            (max(0, int(lines[0]) - AROUND), min(n, int(lines[-1]) + 1 + AROUND))
            for lines, n in ((rows, told.shape[0]), (columns, told.shape[1]))
        )
        small_part = np.s_[top:down, left:right]
        y, x = (_edges(*sizes) for sizes in zip(told.shape, self.clip.size[::-1], strict=True))
        part = np.s_[y[top] : y[down], x[left] : x[right]]
        height, width = y[down] - y[top], x[right] - x[left]

        def enlarged(values: Picture) -> Picture:
            return area_average(values, width, height)

        mean = linear_to_srgb(fine[part])
        detail = mean - enlarged(area_average(mean, right - left, down - top))
        clearly = self._spread(told)[part]
        most = np.quantile(np.abs(detail[clearly]), MOST_DETAIL, axis=0) if clearly.any() else np.zeros(3, np.float32)
        detail = np.clip(detail * self._spread(contrast)[part][..., None], -most, most)
        filled = srgb_to_linear(np.maximum(enlarged(linear_to_srgb(image[small_part])) + detail, 0))
        fine[part] = np.where(clearly[..., None], fine[part], filled)
        return fine

    def _mean(self, shown: Mask) -> Picture:
        """The linear mean of whole frames over the times at which they are ``shown``, as ``clear`` of `_fine` says."""
        sizes = zip(shown.shape[1:], self.clip.size[::-1], strict=True)
        down, across = (_edges(*each) for each in sizes)
        total = np.zeros((down[-1], across[-1], 3), np.float32)
        times = shown.sum(0, dtype=np.float32)[..., None]
        for number, gain, clear in zip(self.numbers[WHOLE], self.gains[WHOLE], shown, strict=True):
            self.clip.add_weighted(number, clear[..., None] / (gain * times), (down, across), total)
        return total

    def _spread(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values (rows, columns) of reduced pixels, at the pixels of whole pictures that each stands for."""
        rows, columns = (np.diff(_edges(*sizes)) for sizes in zip(values.shape, self.clip.size[::-1], strict=True))
        return np.repeat(np.repeat(values, rows, axis=0), columns, axis=1)


def large_frames(clip: Clip) -> list[int]:
    """Return the numbers of the frames that `large_samples` looks at; none of a clip of small pictures."""
    return clip.spread(SAMPLES) if _divisor(clip) else []


def large_samples(clip: Clip) -> LargeSamples | None:
    """Return what the background of a clip of large pictures is found on; None of small ones.

    Parameters
    ----------
    clip
        Camera and background stand still.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    width, height = clip.size
    numbers, divisor = large_frames(clip), _divisor(clip)
    if not numbers:
        return None
    columns, rows = round(width / divisor), max(1, round(height / divisor))
    reduced = np.empty((len(numbers), rows, columns, 3), np.uint16)
    for sample, number in zip(reduced, numbers, strict=True):
        sample[...] = as_samples(clip.glimpse_average(number, GLIMPSE, linear_to_srgb, columns, rows))
    tiny = [clip.as_seen(n, small(linear_samples(sample))) for n, sample in zip(numbers, reduced, strict=True)]
    gains = sample_gains(np.stack(tiny))
    even_out(reduced, gains)
    return LargeSamples(clip, tuple(numbers), gains, reduced, seen_of(clip, numbers, columns, rows))


def _divisor(clip: Clip) -> int:
    """By what the sides of a clip's pictures are divided; 0 for small ones."""
    enough = min(clip.size) >= BLOCKS_APART * BLOCK  # for the noise
    return COARSER * (max(clip.size) // GLIMPSE) if are_large(clip) and enough else 0


def _edges(count: int, pixels: int) -> Edges:
    """Where each of so many parts of a line of pixels begins, and the end of the last."""
    return np.asarray(-(-np.arange(count + 1) * pixels // count), np.int32)
