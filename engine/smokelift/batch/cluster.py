"""A batch on a cluster that Dask distributed runs: a task a shot.

Dask gives the shots to workers, tries again after a crash, and gives the shots of a lost worker to another one. What it
cannot know is on the storage: a shot that two workers hold is done by one (`smokelift.batch.work`), and after a restart
of the scheduler, which forgets everything, the shots that are not finished are given to it again.
"""

from __future__ import annotations

import logging
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from smokelift.batch.local import RETRIES
from smokelift.batch.record import Record, read_record
from smokelift.batch.shots import BatchShot

if TYPE_CHECKING:
    from smokelift.batch.worker import Task

CONNECT_SECONDS = 30
"""Time for the scheduler to answer."""

PAUSE_SECONDS = 5.0
"""Seconds between two tries to reach a scheduler that went away."""

RETURN_SECONDS = 1800.0
"""Time for a scheduler that went away to return."""

MEMORY = "memory"
"""Resource of a worker, in bytes, that its shots take together; ``dask worker --resources memory=32e9``."""


class ClusterError(ValueError):
    """A cluster that cannot be used, and why."""


class _SchedulerLostError(Exception):
    """The scheduler is away, or has forgotten the tasks."""


def run_on_cluster(
    shots: Sequence[tuple[BatchShot, Record]],
    task: Task,
    address: str,
    say: Callable[[str], None],
    *,
    returns: float = RETURN_SECONDS,
    pause: float = PAUSE_SECONDS,
) -> Iterator[tuple[BatchShot, Record]]:
    """Run shots on the workers of a cluster and yield each when it has ended.

    Leaving early ends them; finished frames stay.

    Parameters
    ----------
    shots
        With what is known of them. Where workers have the resource `MEMORY`, each takes what is foretold of it.
    task
        Runs one to its end.
    address
        Of the scheduler, as ``tcp://host:8786``.
    say
        Is called when the scheduler goes away.
    returns, pause
        Seconds in which a scheduler that went away has to return, and from try to try.
    """
    try:
        import distributed
    except ImportError as error:
        raise ClusterError("--scheduler needs Dask: pip install 'smokelift[cluster]'.") from error
    for name in list(logging.root.manager.loggerDict):
        if name.partition(".")[0] == "distributed":  # it tells of every lost connection; so do we, once
            logging.getLogger(name).setLevel(logging.CRITICAL)
    left = {shot.name: (shot, record) for shot, record in shots}
    batch = uuid.uuid4().hex[:12]
    lost_at: float | None = None
    while left:
        try:
            with distributed.Client(address, timeout=CONNECT_SECONDS, set_as_default=False) as client:
                lost_at = None
                for shot, record in _submitted(client, list(left.values()), task, batch):
                    del left[shot.name]
                    yield shot, record
        except (OSError, _SchedulerLostError) as error:
            now = time.monotonic()
            if lost_at is None and len(left) == len(shots) and not isinstance(error, _SchedulerLostError):
                raise ClusterError(
                    f"{address}: no Dask scheduler answers ({error}); start it, or check its address."
                ) from error
            if lost_at is None:
                say(f"The scheduler at {address} went away; waiting for it to return.")
                lost_at = now
            if now - lost_at > returns:
                raise ClusterError(
                    f"{address}: the scheduler has not returned in {returns:.0f} s; not finished: "
                    f"{', '.join(left)}. Give the same command again to go on with them."
                ) from error
            time.sleep(pause)


def _submitted(
    client: Any, shots: Sequence[tuple[BatchShot, Record]], task: Task, batch: str
) -> Iterator[tuple[BatchShot, Record]]:
    """Give shots to a scheduler and yield each when it has ended; `_SchedulerLostError` if it forgets them."""
    from distributed import KilledWorker, as_completed

    from smokelift.batch import worker

    client.register_plugin(worker.EndShots())
    by_memory = bool(client.run_on_scheduler(_workers_have_memory))
    of: dict[Any, BatchShot] = {}
    try:
        for place, (shot, record) in enumerate(shots):
            needed = {MEMORY: record.forecast.memory} if by_memory and record.forecast is not None else None
            key = f"smokelift-{shot.name}-{uuid.uuid4().hex}"
            options = {"key": key, "retries": RETRIES, "pure": False, "resources": needed}
            # without a priority a worker that comes later begins with either of those given within a tenth of a second
            of[client.submit(worker.work, shot, task, batch, priority=-place, **options)] = shot
        for future in as_completed(list(of), loop=client.loop):
            shot = of[future]
            if future.status in ("cancelled", "lost"):
                raise _SchedulerLostError
            error = future.exception()
            if error is None:
                yield shot, future.result()
            elif isinstance(error, worker.ShotCrashedError):
                yield shot, error.record
            elif isinstance(error, KilledWorker):
                sentence = "The workers that had this shot were lost, one after the other; is there too little memory?"
                yield shot, replace(read_record(shot), status="crashed", sentence=sentence)
            else:
                raise error
            del of[future]
    except (GeneratorExit, KeyboardInterrupt):
        _stop(client, list(of), batch)
        raise


def _stop(client: Any, futures: Sequence[Any], batch: str) -> None:
    """End the tasks that run, which Dask cannot, and then those that wait."""
    from smokelift.batch import worker

    # without a scheduler there is nobody to tell; the workers end their tasks then
    with suppress(Exception):
        client.run(worker.stop_batch, batch)
    with suppress(Exception):
        client.cancel(futures)


def _workers_have_memory(dask_scheduler: Any) -> bool:
    return any(MEMORY in each.resources for each in dask_scheduler.workers.values())
