"""Similarities of the picture plane: a shift, a rotation and a zoom."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.checks.array_types import Mask
from smokelift.footage.images import Picture


@dataclass(frozen=True)
class Similarity:
    """Where a frame shows each point of a reference: z, from the picture's middle, at ``turn`` z + ``shift``.

    Points are complex, columns + i rows, in units of the picture's longer side, so that one similarity holds at every
    size.
    """

    turn: complex = 1.0
    shift: complex = 0.0

    def after(self, other: Similarity) -> Similarity:
        """Return this similarity of what another one yields."""
        return Similarity(self.turn * other.turn, self.turn * other.shift + self.shift)

    def inverse(self) -> Similarity:
        """Return what undoes it."""
        return Similarity(1 / self.turn, -self.shift / self.turn)

    def moves(self, points: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
        """Return how far it moves points."""
        return (self.turn - 1) * points + self.shift

    def reach(self, width: int, height: int) -> float:
        """Return how far it moves the corner that it moves most, in units of the longer side."""
        return float(np.abs(self.moves(corners(width, height))).max())

    def registered(self, frame: Picture, order: int = 3) -> Picture:
        """Return what a frame (rows, columns) or (rows, columns, channels) shows of the reference.

        It is interpolated by splines of an order; outside, the frame is mirrored.
        """
        channels: list[Any] = [frame] if frame.ndim == 2 else list(np.moveaxis(frame, -1, 0))
        matrix, offset = self._of_indices(frame.shape[:2])

        def one(channel: Picture) -> Picture:
            # "mirror" is what the spline's coefficients assume as well
            found = ndimage.affine_transform(channel, matrix, offset, order=order, mode="mirror")
            return np.asarray(found, np.float32)

        if frame.ndim == 2:
            return one(frame)
        with ThreadPoolExecutor(len(channels)) as pool:
            found = np.stack(list(pool.map(one, channels)), axis=-1)
        return np.maximum(found, 0)  # splines overshoot beside edges, and light is not negative

    def nearest(self, seen: Mask) -> Mask:
        """Return which pixels (rows, columns) of the reference a frame shows; ``seen`` are its pixels that count."""
        matrix, offset = self._of_indices(seen.shape)
        shown = ndimage.affine_transform(seen.astype(np.uint8), matrix, offset, order=0, mode="constant")
        return np.asarray(shown, np.bool_)

    def _of_indices(self, shape: tuple[int, ...]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """The matrix and the offset that make indices of a frame of those of the reference."""
        right, down = complex(self.turn).real, complex(self.turn).imag
        matrix = np.array([[right, down], [-down, right]])
        middle = (np.array(shape) - 1) / 2
        shift = max(shape) * np.array([complex(self.shift).imag, complex(self.shift).real])
        return matrix, middle + shift - matrix @ middle


IDENTITY = Similarity()
"""The similarity that moves nothing."""


def corners(width: int, height: int) -> npt.NDArray[np.complex128]:
    """Return the corners (4,) of a picture as a `Similarity` takes points."""
    x, y = np.array([width, height]) / (2 * max(width, height))
    return np.array([-x - 1j * y, x - 1j * y, x + 1j * y, -x + 1j * y])
