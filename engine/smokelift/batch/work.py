"""The work on one shot, by a process of the engine; what is known of it, ``NAME.json``; and many on this machine.

Several processes on several machines may work on the same shot: one does the work, the others wait for it. What
decides is on the storage that they share: the lock, the record and the sequence.
"""

import json
import subprocess
import sys
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import replace
from typing import Any

import psutil

from smokelift.batch.shots import BatchShot, Record, Status, is_finished, read_index, read_record
from smokelift.output.index import Lock
from smokelift_command.exits import BAD_INPUT, CANCELLED, DONE, NO_DEVICE

ENGINE = (sys.executable, "-m", "smokelift_command.tethered")
"""The command line, which ends with the process that started it."""

POLL_SECONDS, GRACE_SECONDS = 0.25, 20.0
"""Seconds between two measurements of a running engine, and of a wait for one, at most: on some systems Python handles
no signal while it waits. Seconds for a cancelled engine to end, which kills itself before that."""

PAUSE_SECONDS = 30.0
"""Seconds between tries while a disk is full, say."""

RETRIES = {"crashed": 2, "stuck": 120}
"""New tries, by how the last one ended; while it is stuck, those of an hour without a new frame."""

_STATUS: dict[int, Status] = {DONE: "done", CANCELLED: "cancelled", BAD_INPUT: "refused", NO_DEVICE: "refused"}

Task = Callable[[BatchShot, threading.Event], Record]
"""Work on a shot, and what ends it; a worker of a cluster has to be able to import it."""

ShotMemory = Mapping[BatchShot, int]
"""Bytes of memory that each shot needs, in the order in which they begin; 0 if that is not known."""


def inspect_shot(shot: BatchShot, stop: threading.Event, engine: Sequence[str] = ENGINE) -> Record:
    """Ask the engine what a shot will take, unless that is known; a record without a forecast says why not."""
    record = read_record(shot)
    if record.forecast is not None:
        return record
    options = [word for word in shot.options if not word.startswith(("--npz", "--start-number"))]
    try:
        shot.folder.mkdir(parents=True, exist_ok=True)
        ended, said = _run(shot, record, ["inspect", str(shot.input), *options], stop, engine, GRACE_SECONDS)
        if ended.status == "done":
            ended = replace(record, forecast={name: said[name] for name in ("frames", "seconds", "memory")})
            ended.write(shot)
        return ended
    except OSError as error:  # the storage itself
        return replace(record, status="stuck", sentence=str(error))


def finish_shot(
    shot: BatchShot,
    stop: threading.Event,
    say: Callable[[str], None] = lambda _text: None,
    pause: float = PAUSE_SECONDS,
    engine: Sequence[str] = ENGINE,
    retries: Mapping[str, int] = RETRIES,
    grace: float = GRACE_SECONDS,
) -> Record:
    """Reconstruct a shot to its end, going on from the frames that are there, and return its record.

    The engine runs only while nobody else has the shot's lock. After a crash it is tried again. A failure that passes
    is waited for: `say` is called with what it is, and `pause` is the seconds until the next try. Once `stop` is set
    the work ends, by force after `grace` seconds; finished frames stay.
    """
    words = ["reconstruct", str(shot.input), "--out", str(shot.directory), "--thumbnail", str(shot.file("png"))]
    lock, tries, frames = Lock(shot.folder / f".{shot.name}.lock"), Counter[str](), 0
    while True:
        try:
            shot.folder.mkdir(parents=True, exist_ok=True)
            free, record = lock.acquire(), read_record(shot)
            if not free:
                record = replace(record, status="stuck", sentence=f"{shot.directory}: another batch is at work.")
            elif not (is_finished(shot, record) or stop.is_set()):
                record = replace(record, status="running", sentence="", runs=record.runs + 1)
                record.write(shot)
                record, _ = _run(shot, record, [*words, "--resume", *shot.options], stop, engine, grace)
                record.write(shot)
        except OSError as error:  # the storage itself
            record = replace(read_record(shot), status="stuck", sentence=str(error))
        finally:
            with suppress(OSError):
                lock.release()
        if stop.is_set() and record.status != "done":
            return replace(record, status="cancelled", sentence="Cancelled; finished frames stay.")
        if (there := len(read_index(shot).frames)) > frames:
            tries["stuck"], frames = 0, there
        tries[record.status] += 1
        if tries[record.status] > retries.get(record.status, 0):
            return record
        if record.status == "stuck":
            say(f"{shot.name}: {record.sentence} It is tried again in {pause:.0f} s.")
            stop.wait(pause)


def run_here(shots: ShotMemory, task: Task, memory: int, workers: int) -> Iterator[tuple[BatchShot, Record]]:
    """Run shots side by side, `workers` at most, and yield each when it has ended.

    A shot starts as soon as the bytes that it needs are left of `memory`, in the order of the shots; a small one may
    overtake a large one. What needs more than all of it runs alone. When the caller leaves early the work ends, and is
    waited for.
    """
    stop = threading.Event()
    waiting, running = list(shots), dict[Future[Record], BatchShot]()
    with ThreadPoolExecutor(workers) as pool:
        try:
            while waiting or running:
                for shot in list(waiting):
                    if has_room(shots[shot], [shots[other] for other in running.values()], memory, workers):
                        waiting.remove(shot)
                        running[pool.submit(task, shot, stop)] = shot
                for future in wait(running, POLL_SECONDS, FIRST_COMPLETED).done:
                    yield running.pop(future), future.result()
        finally:
            stop.set()


def has_room(needed: int, taken: Sequence[int], memory: int, workers: int) -> bool:
    """Whether a shot that needs so many bytes may start beside others that take theirs."""
    return not taken or (len(taken) < workers and sum(taken) + needed <= memory)


def _run(
    shot: BatchShot, record: Record, words: Sequence[str], stop: threading.Event, engine: Sequence[str], grace: float
) -> tuple[Record, dict[str, Any]]:
    """Run the engine and log what it says, as far as the disk allows; the record at its end, and its last message."""
    began, peak, last_words = time.monotonic(), [record.memory], "it said nothing"
    events = defaultdict[str, list[dict[str, Any]]](list)
    command, pipe = [*engine, *words, "--progress", "json"], subprocess.PIPE
    with (
        shot.file("log").open("ab", buffering=0) as log,
        subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT) as process,
    ):
        threading.Thread(target=_watch, args=(process, stop, peak, grace), daemon=True).start()
        try:
            for line in process.stdout or ():
                with suppress(OSError):
                    log.write(line)
                text = line.decode("utf-8", "replace").strip()
                try:
                    said = json.loads(text)
                    events[said["event"]].append(said)
                except (ValueError, LookupError, TypeError):
                    last_words = text or last_words
            code = process.wait()
        finally:
            process.kill()  # nothing, unless we are interrupted ourselves
    message = (events["done"] or events["error"] or [{"text": ""}])[-1]
    status = _STATUS.get(code, "crashed")
    if status != "done" and stop.is_set():  # if it was killed, too
        status = "cancelled"
    elif message.get("later") and status not in ("done", "cancelled"):
        status = "stuck"
    how = f"signal {-code}" if code < 0 else f"status {code}"
    ended = replace(
        record,
        status=status,
        sentence=message["text"] or f"The engine ended by itself ({how}): {last_words}",
        notes=[note["text"] for note in events["note"]] or record.notes,
        seconds=record.seconds + time.monotonic() - began,
        memory=peak[0],
    )
    return ended, message


def _watch(process: subprocess.Popen[bytes], stop: threading.Event, peak: list[int], grace: float) -> None:
    """Measure the memory of a process, and end it when that is asked, by force after a grace of seconds."""
    while process.poll() is None:
        with suppress(psutil.Error):  # it has ended already
            peak[0] = max(peak[0], psutil.Process(process.pid).memory_info().rss)
        if stop.wait(POLL_SECONDS) and process.stdin is not None:
            with suppress(OSError, subprocess.TimeoutExpired):
                process.stdin.close()
                process.wait(grace)
            process.kill()
