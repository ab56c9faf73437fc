"""Frames as a reference shows them, and what they do not show of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse

from smokelift.footage.frame_source import Edges, StoredPicture, Value
from smokelift.footage.images import Picture, sum_lines
from smokelift.footage.mask import KEPT_MASKS, Mask, Seen
from smokelift.footage.similarity import Similarity

KEPT_FRAMES = 2
"""Registered frames that are kept: several parts of the program read one after another."""

Read = Callable[[int], StoredPicture]
MotionOf = Callable[[int], Similarity]


@dataclass(frozen=True, eq=False, kw_only=True)
class RegisteredPicture(StoredPicture):
    """A stored frame that is registered when it is read: many readers need it at reduced size alone.

    ``motion`` is that of the camera in the frame, ``whole`` makes the registered picture.
    """

    motion: Similarity
    whole: Callable[[], Picture]

    def linear(self) -> Picture:
        """Return the linear picture (rows, columns, 3), read-only."""
        return self.whole()

    def cut(self, part: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> StoredPicture:
        """Return the pixels that a function takes, linear."""
        return StoredPicture(part(self.whole()))

    def through(self, change: Callable[[Picture], npt.NDArray[Value]]) -> npt.NDArray[Value]:
        """Return the picture with a function applied to each linear value."""
        return change(self.whole())

    def averaged(self, width: int, height: int) -> Picture:
        """Return the `area_average` of the linear picture, registered at that size."""
        return self.motion.registered(StoredPicture(self.values, self.table).averaged(width, height))

    def sum_lines(self, weights: scipy.sparse.csr_array) -> Picture:
        """Return sums (n, columns, 3) of the lines of the linear picture, by weights (n, rows)."""
        return sum_lines(self.whole(), weights)

    def add_weighted(self, weights: Picture, edges: tuple[Edges, Edges], sums: Picture) -> None:
        """Add the linear picture to sums; see `StoredPicture.add_weighted`."""
        StoredPicture(self.whole()).add_weighted(weights, edges, sums)


def registered(read: Read, motion: MotionOf) -> Read:
    """Return what reads the frames of a file registered by their motion."""

    @lru_cache(maxsize=KEPT_FRAMES)
    def whole(number: int) -> Picture:
        picture = motion(number).registered(read(number).linear())
        picture.flags.writeable = False
        return picture

    def frame(number: int) -> StoredPicture:
        stored = read(number)
        return RegisteredPicture(stored.values, stored.table, motion=motion(number), whole=partial(whole, number))

    return frame


class RegisteredMask:
    """What a mask hides in frames that are registered, and what of the reference such frames do not show.

    ``mask`` is that of the frames as they were filmed, if there is one. ``files`` and ``count`` are those of `Mask`.
    """

    def __init__(self, mask: Mask | RegisteredMask | None, motion: MotionOf) -> None:
        self._mask, self._motion = mask, motion
        self.files: tuple[Path, ...] = () if mask is None else mask.files
        self.count: int | None = None if mask is None else mask.count
        self._kept = lru_cache(maxsize=KEPT_MASKS)(self._registered)

    def seen(self, n: int, width: int, height: int) -> Seen:
        """Return which pixels (height, width) of the file's frame ``n`` are not hidden, at any size."""
        return self._kept(n, width, height)

    def close(self) -> None:
        """Close the file."""
        if self._mask is not None:
            self._mask.close()

    def _registered(self, n: int, width: int, height: int) -> Seen:
        whole = np.ones((height, width), np.bool_)
        return self._motion(n).nearest(whole if self._mask is None else self._mask.seen(n, width, height))
