"""All moments of a clip as one camera saw them, and how far apart two have to be to look unlike."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from smokelift.density.observation import ObservedClip, View
from smokelift.density.row_shape import Array, coarse, mean_width, middles_and_widths
from smokelift.density.turntable import Turntable

UNLIKE = 0.35
"""Correlation of two pictures' detail under the best shift below which neither looks like a copy of the other: so much
true pictures from the front and from the side have in common (docs/experiments/side-measures.md)."""

NEARLY = 0.05
"""Correlation above the least of a clip that is as good: smoke that keeps its shape never gets unlike itself, and the
further away a moment is, the more else is different (docs/experiments/long-runs.md)."""

PAIRS = 12
"""Pairs of frames, spread over the clip, from which a correlation is measured."""


@dataclass(frozen=True, eq=False)
class Moments:
    """A clip on the screen of a turntable.

    Attributes
    ----------
    turntable
        Before the camera of the first frame that shows smoke.
    pictures : (frames, rows, columns) float16
        Optical depth; zero where a frame shows nothing.
    offset
        Frames between two moments that look unlike, at most half the clip.
    """

    turntable: Turntable
    pictures: NDArray[np.float16]
    offset: int

    @staticmethod
    def of(clip: ObservedClip) -> Moments | None:
        """Look at every frame of a clip; None if none shows smoke."""
        turntable, pictures = None, {}
        for number in range(clip.length):
            seen = clip.observe(number)
            view = View.of(seen[0], clip.optics) if seen else None
            if view is not None and view.optical_depth.any():
                turntable = turntable or Turntable.before(view.camera, clip.optics.domain)
                pictures[number] = turntable.screen(view.optical_depth, view.camera).astype(np.float16)
        if turntable is None:
            return None
        nothing = np.zeros(turntable.shape, np.float16)
        every = np.stack([pictures.get(number, nothing) for number in range(clip.length)])
        return Moments(turntable, every, unlike_offset(every))

    def apart(self, number: int, offset: int) -> list[tuple[float, Array]]:
        """Return the pictures that are so many frames after a frame, or before it in the clip's second half.

        The two are dissolved into one another about the clip's middle, over as many frames as the offset has.

        Returns
        -------
        Shares that add up to 1, and pictures (rows, columns).
        """
        count = len(self.pictures)
        past = float(np.clip((number + 0.5 - count / 2) / max(offset, 1) + 0.5, 0, 1))
        # at the ends of a dissolve that is as long as the clip there is no frame so far away
        after, before = min(number + offset, count - 1), max(number - offset, 0)
        return [(1 - past, self.pictures[after].astype(np.float64)), (past, self.pictures[before].astype(np.float64))]


def unlike_offset(pictures: NDArray[np.float16]) -> int:
    """Return after how many frames smoke looks unlike itself in pictures (frames, rows, columns), at most half.

    Where it never does, as few frames as leave it nearly as unlike as it gets.
    """
    correlation: dict[int, float] = {}
    for offset in _steps(len(pictures) // 2):
        alike = [_detail_correlation(a, b) for a, b in _pairs(pictures, offset)]
        if alike:
            correlation[offset] = float(np.mean(alike))
            if correlation[offset] < UNLIKE:
                return offset
    least = min(correlation.values(), default=0.0)
    return next((offset for offset, value in correlation.items() if value <= least + NEARLY), len(pictures) // 2)


def _steps(longest: int) -> Iterator[int]:
    """Offsets up to the longest: all small ones, then each an eighth more than the one before."""
    offset = 1
    while offset <= longest:
        yield offset
        offset += max(1, offset // 8)


def _pairs(pictures: NDArray[np.float16], offset: int) -> Iterator[tuple[Array, Array]]:
    """Pictures so many frames apart, both with smoke."""
    for first in np.unique(np.linspace(0, len(pictures) - 1 - offset, PAIRS).round().astype(int)):
        a, b = pictures[first].astype(np.float64), pictures[first + offset].astype(np.float64)
        if a.any() and b.any():
            yield a, b


def _detail_correlation(a: Array, b: Array) -> float:
    """Correlation of two pictures' detail under the best shift: smoke that only moves on is a copy."""
    shape = [fft.next_fast_len(2 * n, real=True) for n in a.shape]
    product = np.conj(fft.rfft2(_detail(a), shape)) * fft.rfft2(_detail(b), shape)
    return float(fft.irfft2(product, shape).max())


def _detail(picture: Array) -> Array:
    """What a blur takes away of a picture, at unit norm."""
    detail = picture - coarse(picture, mean_width(picture, middles_and_widths(picture)[1]))
    return np.asarray(detail / max(float(np.linalg.norm(detail)), 1e-30))
