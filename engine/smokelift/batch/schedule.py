"""What a batch still takes on so many workers, from what was measured."""

from __future__ import annotations

import heapq
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from smokelift.batch.record import ShotState
from smokelift.batch.shots import BatchShot

Basis = Literal["measured", "scaled", "foretold"]


@dataclass(frozen=True)
class Remaining:
    """What is left of a shot.

    Attributes
    ----------
    shot
        The shot.
    frames
        How many are not finished.
    seconds
        How long they take.
    memory
        Bytes at the peak: what was measured, or what is foretold if that is more.
    basis
        ``"measured"``: at the pace of the shot's own frames; ``"scaled"``: as foretold, times what other shots of the
        batch took over what was foretold of them; ``"foretold"`` where nothing was measured yet.
    """

    shot: BatchShot
    frames: int
    seconds: float
    memory: int
    basis: Basis


def remaining_work(states: Iterable[ShotState]) -> tuple[Remaining, ...]:
    """Return what is left of each shot that is not finished and whose clip was inspected, longest first."""
    states = list(states)
    ratios = [
        statistics.fmean(frames.seconds) * record.forecast.frames / record.forecast.seconds
        for _, record, frames in states
        if record.forecast is not None and record.forecast.seconds > 0 and frames.seconds
    ]
    scale = statistics.median(ratios) if ratios else None
    left = []
    for shot, record, frames in states:
        if record.forecast is None or frames.complete:
            continue
        forecast = record.forecast
        missing = max(0, forecast.frames - frames.count)
        if frames.seconds:
            basis: Basis = "measured"
            seconds_a_frame = statistics.fmean(frames.seconds)
        else:
            basis = "foretold" if scale is None else "scaled"
            seconds_a_frame = forecast.seconds / max(1, forecast.frames) * (scale or 1.0)
        left.append(Remaining(shot, missing, missing * seconds_a_frame, max(forecast.memory, record.memory), basis))
    return tuple(sorted(left, key=lambda each: -each.seconds))


def duration(left: Sequence[Remaining], workers: int) -> float:
    """Return the seconds that so many workers take, a shot at a time each, the longest shots first.

    At most a third more than the best order (Graham, SIAM J. Appl. Math. 17, 1969, 416).
    """
    free_at = [0.0] * workers
    for each in left:
        heapq.heapreplace(free_at, free_at[0] + each.seconds)
    return max(free_at)
