"""A batch on this machine: as many shots at a time as its memory and its processors allow."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

from smokelift.batch.shots import BatchShot
from smokelift.batch.work import Record, ShotMemory, Task

WAKE_SECONDS = 0.5
"""Python handles no signal while it waits on some systems, so that no wait is longer."""


def run_here(shots: ShotMemory, task: Task, memory: int, workers: int) -> Iterator[tuple[BatchShot, Record]]:
    """Run shots side by side, `workers` at most, and yield each when it has ended.

    A shot starts as soon as its part of `memory` is left, in the order of the list; a small one may overtake a large
    one. What needs more than all of it runs alone. When the caller leaves early the work ends, and is waited for.
    """
    stop = threading.Event()
    waiting, running = list(shots), dict[Future[Record], tuple[BatchShot, int]]()
    with ThreadPoolExecutor(workers) as pool:
        try:
            while waiting or running:
                for shot, needed in list(waiting):
                    taken = sum(each for _, each in running.values())
                    if not running or (len(running) < workers and taken + needed <= memory):
                        waiting.remove((shot, needed))
                        running[pool.submit(task, shot, stop)] = shot, needed
                for future in wait(running, WAKE_SECONDS, FIRST_COMPLETED).done:
                    yield running.pop(future)[0], future.result()
        finally:
            stop.set()
