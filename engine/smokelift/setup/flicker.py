"""By how much a frame is exposed more or less than those beside it, where nothing but the smoke shows it.

A frame in which smoke is brighter than its light allows shows either brighter smoke or more of its light. Smoke grows,
fades and moves on: its light does not go up and down from each frame to the next. Exposure that flickers does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from smokelift.setup.coarse import CoarseFrame

FRAMES = 5
"""Frames that are looked at: those beside a frame, and those beside them."""

FEWEST = 4
"""Frames that tell: three go up and down once, which the smoke's own light may do."""

STEADY = 0.02
"""Exposure that differs by less from that of the frames beside it is taken to be the same: a clip of 8 bits tells no
less of its light."""


def light_of(frame: CoarseFrame) -> float:
    """What the smoke changes in a picture, summed up."""
    return float(np.abs(frame.picture - frame.plate.image).sum(dtype=np.float64))


def exposure_of(number: int, frames: int, light: Callable[[int], float]) -> float:
    """Exposure of a frame beside that of its neighbours.

    Parameters
    ----------
    number
        Of the frame.
    frames
        In the clip.
    light
        Of a frame by its number (`light_of`).

    Returns
    -------
    1 where the light does not go up and down from each frame to the next.
    """
    first = max(min(number - FRAMES // 2, frames - FRAMES), 0)
    looked_at = range(first, min(first + FRAMES, frames))
    if len(looked_at) < FEWEST:
        return 1.0
    return beside_others([light(other) for other in looked_at], number - first)


def beside_others(lights: Sequence[float], at: int) -> float:
    """The same from the light of frames in a row, of which one is asked for.

    Examples
    --------
    >>> round(beside_others([1.1, 0.9, 1.1, 0.9, 1.1], 2), 3)
    1.1
    >>> beside_others([1.0, 1.2, 1.3, 1.3, 1.2], 2)
    1.0
    """
    values = np.asarray(lights, np.float64)
    bends = (2 * values[1:-1] - values[:-2] - values[2:]) / 4
    bends *= (-1.0) ** (np.arange(1, len(values) - 1) - at)
    if not (np.all(bends > 0) or np.all(bends < 0)):
        return 1.0
    least = float(bends[np.argmin(np.abs(bends))])
    steady = values[at] - least
    return float(values[at] / steady) if steady > 0 else 1.0
