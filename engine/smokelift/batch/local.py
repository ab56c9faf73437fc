"""A batch on this machine: as many shots at a time as its memory and its processors allow."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

from smokelift.batch.record import Record
from smokelift.batch.shots import BatchShot

Work = Callable[[BatchShot], Record]

RETRIES = 2
"""New tries after a crash of the engine."""

WAKE_SECONDS = 0.5
"""Python handles no signal while it waits on some systems, so that no wait is longer."""


@dataclass(frozen=True)
class Room:
    """What the shots may take together: bytes of memory, and how many run at a time."""

    memory: int
    shots: int


def run_here(
    shots: Sequence[tuple[BatchShot, Record]], work: Work, room: Room, stop: threading.Event
) -> Iterator[tuple[BatchShot, Record]]:
    """Run shots side by side and yield each when it has ended.

    A shot starts as soon as its memory is left, in the order of the list; a small one may overtake a large one. What
    needs more than all of it, or has no forecast, runs alone. When the caller leaves early `stop` is set: the work
    ends, and is waited for.
    """
    waiting = list(shots)
    running: dict[Future[Record], tuple[BatchShot, int]] = {}
    with ThreadPoolExecutor(max_workers=room.shots) as pool:
        try:
            while waiting or running:
                for pair in list(waiting):
                    taken = [memory for _shot, memory in running.values()]
                    forecast = pair[1].forecast
                    memory = forecast.memory if forecast is not None else room.memory
                    if not taken or (len(taken) < room.shots and sum(taken) + memory <= room.memory):
                        waiting.remove(pair)
                        running[pool.submit(_with_retries, work, pair[0])] = pair[0], memory
                ended, _ = wait(running, WAKE_SECONDS, FIRST_COMPLETED)
                for future in ended:
                    shot, _memory = running.pop(future)
                    yield shot, future.result()
        finally:
            stop.set()


def _with_retries(work: Work, shot: BatchShot) -> Record:
    for _ in range(RETRIES):
        record = work(shot)
        if record.status != "crashed":
            return record
    return work(shot)
