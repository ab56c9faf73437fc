"""The time that frames take, in seconds and in Poisson solves of the same grid."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from benchmarks.machine import poisson_seconds

Frame = TypeVar("Frame")

UNTIMED = 2
"""Frames that do not count: the first two come together, and compilers work before them."""


class FrameTimes:
    """Times of a run's frames. Between them a Poisson solve is timed, because the machine may be busy.

    Parameters
    ----------
    shape
        Voxels along x, y and z.
    clock
        Returns the time now (s): what a user waits, or `time.process_time`, which counts the work of all cores and is
        the same beside other work.
    """

    def __init__(self, shape: tuple[int, int, int], clock: Callable[[], float] = time.perf_counter) -> None:
        self._shape, self._clock = shape, clock
        self._seconds: list[float] = []
        self._units: list[float] = []

    def before(self, action: Callable[[Frame], object]) -> Callable[[Frame], None]:
        """Return what to call with each frame once it is made: it times the making from now on, but not the action."""
        began = self._clock()

        def timed(frame: Frame) -> None:
            nonlocal began
            self._seconds.append(self._clock() - began)
            self._units.append(poisson_seconds(self._shape, self._clock))
            action(frame)
            began = self._clock()

        return timed

    @property
    def seconds(self) -> float:
        """A frame (s), the median."""
        return median(self._seconds)

    @property
    def solves(self) -> float:
        """A frame in Poisson solves."""
        return self.seconds / median(self._units)


def median(values: list[float]) -> float:
    """Return the median over the frames that count; over all, if there are no others."""
    return float(np.median(values[UNTIMED:] or values))
