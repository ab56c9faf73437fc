"""What a worker of a Dask cluster does with a shot; needs Dask."""

from __future__ import annotations

import platform
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from distributed import Reschedule, WorkerPlugin

from smokelift.batch.record import Record, read_record
from smokelift.batch.shots import BatchShot

Task = Callable[[BatchShot, threading.Event], Record]
"""Work that a worker can import: it gets the shot and what ends it."""

_STOPS: dict[str, threading.Event] = {}
"""What ends the shots that this process works on, by batch."""

_CLOSING = threading.Event()
"""Whether this worker ends."""


class ShotCrashedError(RuntimeError):
    """The engine ended by itself; Dask tries again, where it likes."""

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.record = record


class EndShots(WorkerPlugin):  # type: ignore[misc]  # Dask is not followed
    """Ends the shots of a worker that ends: Dask would wait for them, and give them up only then."""

    name = "smokelift-end-shots"
    idempotent = True

    def teardown(self, worker: Any) -> None:
        """Called by Dask."""
        _CLOSING.set()
        for stop in list(_STOPS.values()):
            stop.set()


def work(shot: BatchShot, task: Task, batch: str) -> Record:
    """Work on a shot.

    It raises ShotCrashedError if the engine ended by itself, and Reschedule if the worker ends before the shot does.
    """
    try:
        record = task(shot, _STOPS.setdefault(batch, threading.Event()))
    except OSError as error:  # to the batch that would look like a lost connection
        return replace(read_record(shot), status="stuck", sentence=f"{platform.node()}: {error}")
    if record.status == "cancelled" and _CLOSING.is_set():
        raise Reschedule
    if record.status == "crashed":
        raise ShotCrashedError(record)
    return record


def stop_batch(batch: str) -> None:
    """End the shots of a batch that this worker works on, and take no more."""
    _STOPS.setdefault(batch, threading.Event()).set()
