"""The work on one shot, wherever it is done: inspect its clip, and reconstruct it to its end.

It may be called for the same shot by several processes on several machines: one does the work, the others wait for it.
What decides is on the storage that they share: the lock, the record and the sequence.
"""

from __future__ import annotations

import platform
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from smokelift.batch.engine import ENGINE, EngineResult, run_engine
from smokelift.batch.record import Forecast, Record, Status, finished_frames, read_record, read_state
from smokelift.batch.shots import BatchShot
from smokelift.output.lock import Lock
from smokelift_command import BAD_INPUT, CANCELLED, DONE, NO_DEVICE


@dataclass(frozen=True)
class Patience:
    """How long to wait for failures that pass: a full disk, a server that is away, memory that others use.

    In seconds: the pause before the first new try, each further one being twice as long up to the longest, and the
    total without a new frame after which the shot is given up.
    """

    pause: float = 5.0
    longest_pause: float = 120.0
    total: float = 3600.0


PATIENCE = Patience()


def look_at_shot(shot: BatchShot, stop: threading.Event, engine: Sequence[str] = ENGINE) -> Record:
    """Ask the engine what a shot will take, unless that is known.

    The record has a forecast; or it is ``refused`` with the reason, and not kept.
    """
    record = read_record(shot)
    if record.forecast is not None:
        return record
    shot.folder.mkdir(parents=True, exist_ok=True)
    # `inspect` writes nothing
    options = [word for word in shot.options if not word.startswith(("--npz", "--start-number"))]
    result = run_engine(["inspect", str(shot.input), *options], stop, shot.log, engine)
    if result.status != DONE:
        return replace(record, status=_status(result), sentence=result.sentence)
    known = result.details
    record = replace(record, forecast=Forecast(int(known["frames"]), float(known["seconds"]), int(known["memory"])))
    record.write(shot)
    return record


def finish_shot(
    shot: BatchShot,
    stop: threading.Event,
    say: Callable[[str], None] = lambda _text: None,
    patience: Patience = PATIENCE,
    engine: Sequence[str] = ENGINE,
) -> Record:
    """Reconstruct a shot to its end, going on from the frames that are there.

    A failure that passes is waited for, and `say` is called with what it is. After a crash the caller decides where to
    try again. Once `stop` is set the work ends; finished frames stay. The record is returned as it was written beside
    the sequence.
    """
    waited, pause, frames = 0.0, patience.pause, -1
    while True:
        try:
            record, retry = _try(shot, stop, engine)
        except OSError as error:  # the storage itself
            record, retry = replace(read_record(shot), status="stuck", sentence=str(error)), True
        if stop.is_set() and record.status != "done":
            return replace(record, status="cancelled", sentence="Cancelled; finished frames stay.")
        if not retry:
            return record
        if (there := finished_frames(shot).count) > frames:
            waited, pause, frames = 0.0, patience.pause, there
        if waited >= patience.total:
            return record
        say(f"{shot.name}: {record.sentence} It is tried again in {pause:.0f} s.")
        stop.wait(pause)
        waited, pause = waited + pause, min(2 * pause, patience.longest_pause)


def _try(shot: BatchShot, stop: threading.Event, engine: Sequence[str]) -> tuple[Record, bool]:
    """Run the engine once, if nobody else does; return what came of it and whether to try again later."""
    shot.folder.mkdir(parents=True, exist_ok=True)
    lock = Lock(shot.folder / f".{shot.name}.lock")
    if not lock.acquire():
        sentence = f"{shot.directory}: another batch is at work on this shot."
        return replace(read_record(shot), status="stuck", sentence=sentence), True
    try:
        before = read_record(shot)
        if read_state(shot).finished or stop.is_set():
            return before, False
        before = replace(before, status="running", sentence="", runs=before.runs + 1, machine=platform.node())
        before.write(shot)
        arguments = ["reconstruct", str(shot.input), "--out", str(shot.directory), "--thumbnail", str(shot.picture)]
        result = run_engine([*arguments, "--resume", *shot.options], stop, shot.log, engine)
        record = replace(
            before,
            status=_status(result),
            sentence=result.sentence,
            notes=tuple(result.notes) or before.notes,
            seconds=before.seconds + result.seconds,
            processor_seconds=before.processor_seconds + result.processor_seconds,
            memory=max(before.memory, result.memory),
        )
        _write_with_retries(record, shot, stop)
        return record, result.retryable and result.status != DONE
    finally:
        lock.release()


WRITE_PAUSES = (0.5, 2.0, 8.0)
"""Seconds between tries to write a record. A shot without one is prepared once more, and keeps its frames."""


def _write_with_retries(record: Record, shot: BatchShot, stop: threading.Event) -> None:
    """Write a record; OSError if that fails after all pauses."""
    for pause in WRITE_PAUSES:
        try:
            return record.write(shot)
        except OSError:
            stop.wait(pause)
    record.write(shot)


def _status(result: EngineResult) -> Status:
    if result.status == DONE:
        return "done"
    if result.status == CANCELLED:
        return "cancelled"
    if result.retryable:
        return "stuck"
    return "refused" if result.status in (BAD_INPUT, NO_DEVICE) else "crashed"
