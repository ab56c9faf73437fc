"""Retiming that is tried out: which frame of a take is shown when.

Speeds lie evenly from the first frame of the take to the last and change linearly in between, as in the engine's
``retime``. Where the speed goes from s0 by k for each frame, the place after a time t is s0 (exp(k t) - 1) / k.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True)
class Retiming:
    """How a take is passed through."""

    # when each begins; first place, speed there, and change of the speed for each frame
    ramps: tuple[tuple[float, float, float, float], ...]
    duration: float  # until the last frame has been shown for its time, in frames

    def place(self, time: str) -> str:
        """The place in the take, from 0, as an expression for a driver, of an expression for the time."""
        return self._chosen(time, [_place(*ramp[1:], f"({time}-{ramp[0]:.9g})") for ramp in self.ramps])

    def speed(self, time: str) -> str:
        """The speed, likewise."""
        return self._chosen(time, [_speed(*ramp[2:], f"({time}-{ramp[0]:.9g})") for ramp in self.ramps])

    def _chosen(self, time: str, values: list[str]) -> str:
        """The value of the ramp that a time is in."""
        text = values[-1]
        for value, (end, *_) in zip(values[-2::-1], self.ramps[:0:-1], strict=True):
            text = f"({value} if {time}<{end:.9g} else {text})"
        return text


def retiming(count: int, speeds: Sequence[float]) -> Retiming:
    """The pace of a take of so many frames, with one speed or more."""
    if len(speeds) == 1:
        return Retiming(((0.0, 0.0, speeds[0], 0.0),), count / speeds[0])
    length, time = (count - 1) / (len(speeds) - 1), 0.0
    ramps: list[tuple[float, float, float, float]] = []
    for number, (before, after) in enumerate(pairwise(speeds)):
        change = (after - before) / length if length else 0.0
        even = math.isclose(before, after, rel_tol=1e-6)
        ramps.append((time, number * length, before, 0.0 if even else change))
        time += length / before if even else math.log(after / before) / change
    return Retiming(tuple(ramps), time + 1 / speeds[-1])


def _place(first: float, speed: float, change: float, time: str) -> str:
    if change == 0.0:
        return f"{first:.9g}+{speed:.9g}*{time}"
    return f"{first:.9g}+{speed / change:.9g}*(exp({change:.9g}*{time})-1)"


def _speed(speed: float, change: float, time: str) -> str:
    return f"{speed:.9g}" if change == 0.0 else f"{speed:.9g}*exp({change:.9g}*{time})"
