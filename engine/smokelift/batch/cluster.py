"""A batch on a cluster that Dask distributed runs, a task per shot; needs Dask.

Dask gives the shots to workers, and those of a lost worker to another one. What it cannot know is on the storage: a
shot that two workers hold is done by one (`smokelift.batch.work`), and after a restart of the scheduler, which forgets
everything, the shots that are not finished are given to it again.
"""

import logging
import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import distributed

from smokelift.batch.shots import BatchShot, Record, read_record
from smokelift.batch.work import ShotMemory, Task

CONNECT_SECONDS, RETURN_SECONDS = 30, 1800
"""Seconds for the scheduler to answer, and to return if it goes away."""

MEMORY = "memory"
"""Resource of a worker, in bytes, that its shots take together; ``dask worker --resources memory=32e9``."""


class Stop(distributed.WorkerPlugin):  # type: ignore[misc]  # Dask is not followed
    """What ends the shots of a batch on a worker: Dask ends no task that runs, and would wait for it."""

    def setup(self, worker: Any) -> None:
        """Called by Dask, on the worker."""
        self.event = threading.Event()

    def teardown(self, worker: Any) -> None:
        """Called by Dask when the worker closes, or the batch is left."""
        self.event.set()


def run_on_cluster(
    shots: ShotMemory, task: Task, address: str, say: Callable[[str], None]
) -> Iterator[tuple[BatchShot, Record]]:
    """Run shots on the workers of the scheduler at an address, as ``tcp://host:8786``, and yield each at its end.

    Workers that have the resource `MEMORY` count the bytes that shots need. Leaving early ends them; finished frames
    stay. `say` is called when the scheduler goes away; ValueError if it does not answer, or not return.
    """
    for name in list(logging.root.manager.loggerDict):
        if name.partition(".")[0] == "distributed":  # it tells of every lost connection; so do we, once
            logging.getLogger(name).setLevel(logging.CRITICAL)
    left, batch, seconds = dict(shots), f"smokelift-{uuid.uuid4().hex}", CONNECT_SECONDS
    while left:
        try:
            client = distributed.Client(address, timeout=seconds, set_as_default=False)
        except OSError as error:
            raise ValueError(
                f"{address}: no Dask scheduler answers ({error}); start it, or check its address. Not finished: "
                f"{', '.join(shot.name for shot in left)}. Give the same command again to go on with them."
            ) from error
        with suppress(OSError), client:
            for shot, record in _submitted(client, left, task, batch):
                yield shot, record
                del left[shot]
        if left:
            say(f"The scheduler at {address} went away; waiting for it to return.")
            seconds = RETURN_SECONDS


def _submitted(client: Any, shots: ShotMemory, task: Task, batch: str) -> Iterator[tuple[BatchShot, Record]]:
    """Give shots to a scheduler and yield each when it has ended; ConnectionError if it forgets them."""
    client.register_plugin(Stop(), name=batch)
    by_memory = client.run_on_scheduler(
        lambda dask_scheduler: any(MEMORY in each.resources for each in dask_scheduler.workers.values())
    )
    of: dict[Any, BatchShot] = {}
    try:
        for place, (shot, memory) in enumerate(shots.items()):
            needed = {MEMORY: memory} if by_memory else None
            # without a priority a worker that comes later begins with either of those given within a tenth of a second
            of[client.submit(work, shot, task, batch, priority=-place, pure=False, resources=needed)] = shot
        for future in distributed.as_completed(list(of), loop=client.loop):
            if future.status in ("cancelled", "lost"):
                raise ConnectionError("the scheduler forgot the shots")
            try:
                record = future.result()
            except distributed.KilledWorker:
                sentence = "The workers that had this shot were lost, one after the other; is there too little memory?"
                record = replace(read_record(of[future]), status="crashed", sentence=sentence)
            yield of.pop(future), record
    finally:
        if client.status == "running":  # else there is nobody to tell; the workers end their tasks then
            with suppress(Exception):
                client.cancel(list(of))
                client.unregister_worker_plugin(batch)


def work(shot: BatchShot, task: Task, batch: str) -> Record:
    """Work on a shot of the batch with this name, on a worker; Reschedule if that ends before the shot does."""
    record = task(shot, distributed.get_worker().plugins[batch].event)
    if record.status == "cancelled":
        raise distributed.Reschedule
    return record
