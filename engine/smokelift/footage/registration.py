"""Registration: frames as a reference shows them, by a similarity of the picture plane each."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.frame_source import StoredPicture
from smokelift.footage.images import Picture
from smokelift.footage.mask import MAX_CACHED_MASKS, Mask, Seen

MAX_CACHED_FRAMES = 2
"""Registered frames that are kept: several parts of the program read one after another."""

Read = Callable[[int], StoredPicture]


@dataclass(frozen=True)
class Similarity:
    """Where a frame shows each point of a reference: z, from the picture's middle, at ``turn`` z + ``shift``.

    Points are complex, columns + i rows, in units of the picture's longer side, so that one similarity holds at every
    size.
    """

    turn: complex = 1.0
    shift: complex = 0.0

    def after(self, other: "Similarity") -> "Similarity":
        """Return this similarity of what another one yields."""
        return Similarity(self.turn * other.turn, self.turn * other.shift + self.shift)

    def inverse(self) -> "Similarity":
        """Return what undoes it."""
        return Similarity(1 / self.turn, -self.shift / self.turn)

    def moves(self, points: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
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

    def nearest(self, seen: Seen) -> Seen:
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


@dataclass(frozen=True, eq=False, kw_only=True)
class RegisteredPicture(StoredPicture):
    """A stored frame that is registered when it is read: many readers need it at reduced size alone.

    Its ``values`` are the frame's. ``motion`` is that of the camera in it, ``whole`` makes the registered picture.
    """

    raw: StoredPicture
    motion: Similarity
    whole: Callable[[], Picture]

    def linear(self) -> Picture:
        """Return the linear picture (rows, columns, 3), read-only."""
        return self.whole()

    def averaged(self, width: int, height: int) -> Picture:
        """Return the `area_average` of the linear picture, registered at that size."""
        return self.motion.registered(self.raw.averaged(width, height))


def registered(read: Read, motion: Callable[[int], Similarity]) -> Read:
    """Return what reads the frames of a file registered by their motion."""

    @lru_cache(maxsize=MAX_CACHED_FRAMES)
    def whole(number: int) -> Picture:
        picture = motion(number).registered(read(number).linear())
        picture.flags.writeable = False
        return picture

    def frame(number: int) -> StoredPicture:
        raw = read(number)
        return RegisteredPicture(raw.values, raw=raw, motion=motion(number), whole=partial(whole, number))

    return frame


def registered_mask(mask: Mask | None, motion: Callable[[int], Similarity]) -> Mask:
    """Return what a mask hides in frames that are registered, and what of the reference such frames do not show.

    ``mask`` is that of the frames as they were filmed, if there is one.
    """

    @lru_cache(maxsize=MAX_CACHED_MASKS)
    def seen(n: int, width: int, height: int) -> Seen:
        return motion(n).nearest(np.ones((height, width), np.bool_) if mask is None else mask.seen(n, width, height))

    return Mask(seen) if mask is None else replace(mask, seen=seen)
