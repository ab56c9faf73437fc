"""A small copy of a clip: every estimate of its background, its noise and its smoke reads it.

The file is decoded once, at frames spread evenly over all of it and over the part in use, and kept at one size. The
rest of the file may show what is behind the smoke of a short part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError, StoredPicture
from smokelift.footage.images import Picture, brightest_channel, linear_to_srgb, reduced_size
from smokelift.footage.mask import Seen
from smokelift.footage.noise import (
    Noise,
    gain_of,
    noise_of,
    sample_gains,
    small,
    some_blocks,
    spread_about,
    white_noise,
)

PROXY_SIDE = 480
"""Pixels along the longer side: lengths in `clean_plate` hold at some hundred (docs/experiments/background.md)."""

FRAMES = 32
"""Largest number of frames of the file, and of the clip. A half is enough for a median, a third for a false-alarm rate
of 1e-3 if every second pair of smoke's samples is alike."""

NOISE_FRAMES = 16
"""Frames of the clip that white noise is measured on."""

MAX_INVISIBLE_CHANGE = np.float32(4 / 255)
"""Change in sRGB values up to which a pixel counts as unchanged."""

SAME_SHOT, STEADY = 0.25, 0.5
"""Largest fraction of the pixels that stay unchanged at a cut, and smallest fraction from one frame to the next beside
it: if the camera moves or smoke fills the picture, fewer do all the time."""


@dataclass(frozen=True, eq=False)
class Proxy:
    """Small frames of a clip's file."""

    numbers: tuple[int, ...]
    """The frames' numbers in the file, ascending."""
    clip: tuple[int, int]
    """First and last frame of the file that the clip uses."""
    pictures: Picture
    """(frames, rows, columns, 3): linear; what a mask hides is continued from around it."""
    filmed: Picture
    """(frames, rows, columns, 3): the same with what a mask hides."""
    seen: NDArray[np.bool_]
    """(frames, rows, columns) bool: pixels that no mask hides."""
    gains: Picture
    """(frames, 3): exposure of the file's frames over that of the pictures: 1, unless they are `evened`."""
    blocks: Mapping[int, tuple[StoredPicture, Seen | None]]
    """For `NOISE_FRAMES` of the clip's frames, `some_blocks` of the full picture, and where no mask hides them (None
    without one)."""
    scale: float
    """Pixels of the file along one pixel here."""

    @staticmethod
    def of(clip: Clip, beyond: bool = True) -> Proxy:
        """Read the frames, ``beyond`` the part in use too; ClipError is raised if one of that part cannot be read."""
        numbers = clip.numbers
        (columns, rows), whole = reduced_size(*clip.size, PROXY_SIDE), clip.whole()
        pictures, filmed, seen, blocks = {}, [], [], {}
        own = [numbers[n] for n in clip.spread(FRAMES)]
        noisy = {own[n] for n in np.linspace(0, len(own) - 1, NOISE_FRAMES).round().astype(int)}
        for number in sorted({*own} | set(whole.spread(FRAMES) if beyond else ())):
            inside = number in numbers
            of, n = (clip, numbers.index(number)) if inside else (whole, number)
            with suppress(*() if inside else (ClipError,)):
                picture = of.stored(n)
                if clip.mask is not None:
                    filmed.append(of.as_filmed().stored(n).averaged(columns, rows))
                pictures[number] = picture.averaged(columns, rows)
                shown = of.seen(n, columns, rows)
                seen.append(np.ones((rows, columns), np.bool_) if shown is None else shown)
                if number in noisy:
                    hides = of.seen(n, *clip.size)
                    blocks[number] = picture.cut(some_blocks), None if hides is None else some_blocks(hides)
        scale = max(clip.size) / max(columns, rows)
        whole_file = np.stack(list(pictures.values()))
        bare = np.stack(filmed) if filmed else whole_file
        gains, used = np.ones((len(pictures), 3), np.float32), (numbers[0], numbers[-1])
        return Proxy(tuple(pictures), used, whole_file, bare, np.stack(seen), gains, blocks, scale)

    @cached_property
    def encoded(self) -> Picture:
        """The pictures in sRGB values."""
        return linear_to_srgb(self.pictures)

    def with_own(self, part: Proxy) -> Proxy:
        """Return a part of the frames, and the middle one of those that the clip uses if it has none of them."""
        first, last = self.clip
        own = [number for number in self.numbers if first <= number <= last]
        if any(number in part.numbers for number in own):
            return part
        wanted = {*part.numbers, own[len(own) // 2]}
        return self.only(np.array([n for n, number in enumerate(self.numbers) if number in wanted]))

    def shot(self, clip: Clip) -> tuple[Proxy, tuple[int, int] | None]:
        """Return frames of a clip's shot, evenly spread, and those of the file beside a cut within the clip, if any.

        At a cut most of the picture changes at once and for good, while little changes in as many frames beside it: on
        the clip's side, for beyond a cut anything may be; on both sides of one within the clip, which smoke may fill.
        """
        tiny = [small(picture) for picture in self.filmed]
        first, last, within = self.numbers[0], self.numbers[-1], None
        for n, (before, after) in enumerate(pairwise(self.numbers)):
            if _alike(tiny[n], tiny[n + 1]) >= SAME_SHOT:
                continue
            steady = self._steady(tiny, n)
            if (steady[1] if after <= self.clip[0] else steady[0] if before >= self.clip[1] else min(steady)) < STEADY:
                continue
            if _alike(*(np.median(side, axis=0) for side in (tiny[: n + 1], tiny[n + 1 :]))) >= SAME_SHOT:
                continue
            if after <= self.clip[0]:
                first = after
            elif before >= self.clip[1]:
                last = min(last, before)
            elif within is None:
                within = _cut(clip, before, after, tiny[n], tiny[n + 1])
        inside = np.array([n for n, number in enumerate(self.numbers) if first <= number <= last])
        numbers = np.array(self.numbers)[inside]
        wanted = np.linspace(numbers[0], numbers[-1], min(FRAMES, len(numbers)))
        return self.only(inside[np.unique(np.abs(numbers - wanted[:, None]).argmin(1))]), within

    def _steady(self, tiny: Sequence[Picture], n: int) -> tuple[float, float]:
        """How alike frames are before frame ``n``, and after the next, in as many frames as lie between these two.

        At either end of the file there are none; then it is what the other side says.
        """
        before, after = self.numbers[n], self.numbers[n + 1]
        earlier = [other for other in range(n) if self.numbers[other] <= 2 * before - after]
        later = [other for other in range(n + 2, len(tiny)) if self.numbers[other] >= 2 * after - before]
        pairs = [*((other, n) for other in earlier[-1:]), *((n + 1, other) for other in later[:1])]
        sides = [_alike(tiny[one], tiny[other]) for one, other in pairs] or [0.0]
        return sides[0], sides[-1]

    def with_unchanged(self) -> Proxy:
        """Return `evened` frames with what a mask hides, and never changes, as it was filmed: there is background."""
        if self.seen.all():
            return self
        encoded = linear_to_srgb(self.filmed)
        unchanged = (np.abs(encoded - np.median(encoded, axis=0)) < MAX_INVISIBLE_CHANGE).all((0, -1))
        pictures = np.where((unchanged & ~self.seen)[..., None], self.filmed, self.pictures)
        return replace(self, pictures=pictures, seen=self.seen | unchanged)

    def only(self, which: NDArray[np.intp]) -> Proxy:
        """Return some of the frames, by their indices here."""
        numbers = tuple(self.numbers[n] for n in which)
        pictures, filmed, seen = self.pictures[which], self.filmed[which], self.seen[which]
        return replace(self, numbers=numbers, pictures=pictures, filmed=filmed, seen=seen, gains=self.gains[which])

    @cached_property
    def evened(self) -> Proxy:
        """The pictures at one exposure."""
        hidden = np.where(self.seen[..., None], self.pictures, np.float32(np.nan))
        gains = sample_gains(np.stack([small(picture) for picture in hidden]))
        if (gains == 1).all():
            return self
        even = gains[:, None, None]
        return replace(self, pictures=self.pictures / even, filmed=self.filmed / even, gains=gains)

    def white_noise(self) -> Picture:
        """Return the white noise (3,) of the file's pixels, in sRGB values, measured at one exposure."""
        part, blocks = self.only(np.flatnonzero([number in self.blocks for number in self.numbers])), []
        for number, gain in zip(part.numbers, part.evened.gains, strict=True):
            some, seen = self.blocks[number]
            even = linear_to_srgb(some.linear() / gain)
            blocks.append(even if seen is None else np.where(seen[..., None], even, np.float32(np.nan)))
        return white_noise(np.stack(blocks))

    def deviations(self, background: Picture) -> Picture:
        """Return differences (frames, rows, columns, 3) from a linear background, in sRGB values; NaN is hidden."""
        deviations = self.encoded - linear_to_srgb(background)
        deviations[~self.seen] = np.nan
        return deviations

    def noise_about(self, background: Picture, white: Picture) -> Noise:
        """Return the noise, with a ``white`` part (3,), of the file's pixels about a linear background."""
        return noise_of(white, spread_about(self.deviations(background)), self.scale**2)


def _cut(clip: Clip, last: int, first: int, before: Picture, after: Picture) -> tuple[int, int]:
    """The frames on either side of a cut between two frames of a clip's file, by bisection."""
    rows, columns = before.shape[:2]
    whole = clip.whole()
    while first - last > 1:
        middle = (last + first) // 2
        picture = whole.stored(middle).averaged(columns, rows)
        if _alike(before, picture) >= _alike(picture, after):
            last = middle
        else:
            first = middle
    return last, first


def _alike(one: Picture, other: Picture) -> float:
    """Fraction of the pixels that two pictures have alike, at one exposure if that is more."""
    encoded = linear_to_srgb(one)

    def alike(picture: Picture) -> float:
        return float((brightest_channel(np.abs(linear_to_srgb(picture) - encoded)) < MAX_INVISIBLE_CHANGE).mean())

    found = alike(other)
    return found if found >= STEADY else max(found, alike(other / gain_of(other, one)))
