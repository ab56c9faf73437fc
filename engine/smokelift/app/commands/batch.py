"""``smokelift batch``: a list of shots, on this machine or on many."""

from __future__ import annotations

import argparse
import math
import os
import threading
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, suppress
from typing import Any, NoReturn

import psutil

from smokelift.app.commands import reconstruct
from smokelift.app.options import named_path
from smokelift.app.progress import Reporter
from smokelift.batch import (
    BatchShot,
    Record,
    Remaining,
    Room,
    ShotState,
    duration,
    finish_shot,
    look_at_shot,
    read_shots,
    read_state,
    remaining_work,
    run_here,
    run_on_cluster,
    write_report,
)
from smokelift.checks import counted
from smokelift.report.cost import memory_free

MEMORY_SHARE = 0.9
"""Part of the free memory that shots may take together: forecasts are right to a tenth or two."""

HELP = "reconstruct a list of shots, as many at a time as memory allows"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("list", type=named_path, help="list of shots, such as shots.toml")
    parser.add_argument("--plan", action="store_true", help="say only what is left and how long it will take")
    parser.add_argument(
        "--workers", type=_count, metavar="N", help="run N shots at a time at most (default: one a processor core)"
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="run on a Dask cluster, as tcp://host:8786 (needs the extra [cluster])"
    )


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Run the shots that are not finished; ValueError if the list is wrong, or, at the end, if a shot failed."""
    shots = read_shots(options.list, _check_arguments)
    states = {shot.name: read_state(shot) for shot in shots}
    stop = threading.Event()
    workers = options.workers or os.cpu_count() or 1
    try:
        unfinished = [state for state in states.values() if not state.finished]
        unknown = [(state.shot, state.record) for state in unfinished if state.record.forecast is None]
        if unknown:
            say.note(f"Inspecting {counted(len(unknown), 'clip')} ...")
        with closing(_look_at_shots(options.scheduler, unknown, stop, say)) as looked_at:
            for shot, record in looked_at:
                states[shot.name] = read_state(shot)._replace(record=record)
                if record.forecast is None:
                    say.note(f"{shot.name}: {record.sentence}")
        left = remaining_work(states.values())
        for line in _forecast_lines(left, workers):
            say.note(line)
        if options.plan:
            say.finish(_summary(left, workers), _as_dict(left, workers))
            return
        _run_remaining(options, say, states, left, workers, stop)
    finally:
        stop.set()


def _run_remaining(
    options: argparse.Namespace,
    say: Reporter,
    states: dict[str, ShotState],
    left: Sequence[Remaining],
    workers: int,
    stop: threading.Event,
) -> None:
    """Run what is left and keep the report up to date; ValueError, at the end, if a shot failed."""
    shots = [(each.shot, states[each.shot.name].record) for each in left]
    with closing(_run_shots(options.scheduler, shots, workers, stop, say)) as ended:
        for shot, record in ended:
            states[shot.name] = read_state(shot)._replace(record=record)
            say.note(f"{shot.name}: {record.status}. {record.sentence}")
            with suppress(OSError):  # the storage may be full for a while; the next shot updates the page
                write_report(shot.folder, options.list.stem, list(states.values()))
    final = list(states.values())
    page = write_report(final[0].shot.folder, options.list.stem, final)
    missing = [state.shot.name for state in final if state.record.status != "done"]
    if missing:
        share = f"{len(missing)} of {counted(len(final), 'shot')}"
        raise ValueError(
            f"{share} did not come to the end ({', '.join(missing)}); {page} says why. "
            "Give the same command again to go on."
        )
    say.finish(
        f"Finished: {counted(len(final), 'shot')}; {page} shows the result.",
        {"report": str(page), "shots": [str(state.shot.directory) for state in final]},
    )


def _look_at_shots(
    scheduler: str | None, unknown: Sequence[tuple[BatchShot, Record]], stop: threading.Event, say: Reporter
) -> Generator[tuple[BatchShot, Record], None, None]:
    """Inspect shots one by one, or on a cluster, and yield each with its forecast."""
    if scheduler is not None:
        yield from run_on_cluster(unknown, look_at_shot, scheduler, say.note)
    else:
        yield from ((shot, look_at_shot(shot, stop)) for shot, _ in unknown)


def _run_shots(
    scheduler: str | None,
    shots: Sequence[tuple[BatchShot, Record]],
    workers: int,
    stop: threading.Event,
    say: Reporter,
) -> Generator[tuple[BatchShot, Record], None, None]:
    """Run shots, here or on a cluster, and yield each at its end."""
    if scheduler is not None:
        yield from run_on_cluster(shots, finish_shot, scheduler, say.note)
        return
    room = Room(round(MEMORY_SHARE * memory_free()), workers)
    total = psutil.virtual_memory().total
    fitting = []
    for shot, record in shots:
        if record.forecast is not None and record.forecast.memory > total:
            say.note(
                f"{shot.name}: needs {_gib(record.forecast.memory)} and this machine has {_gib(total)}; choose a lower "
                "resolution."
            )
        else:
            fitting.append((shot, record))
    one_at_a_time = threading.Lock()

    def note(text: str) -> None:
        with one_at_a_time:
            say.note(text)

    def work(shot: BatchShot) -> Record:
        note(f"{shot.name}: begins.")
        return finish_shot(shot, stop, note)

    yield from run_here(fitting, work, room, stop)


def _forecast_lines(left: Sequence[Remaining], workers: int) -> Iterator[str]:
    """Lines on what is left: one for each shot, and one for each useful number of workers."""
    for each in left:
        memory = f"{_gib(each.memory)} of memory"
        yield f"{each.shot.name}: {counted(each.frames, 'frame')}, {_time(each.seconds)}, {memory} ({each.basis})"
    counts = sorted({2**n for n in range(math.ceil(math.log2(max(workers, 1))) + 1) if 2**n < workers} | {workers})
    for count in counts if left else ():
        yield f"{count} at a time: {_time(duration(left, count))}"


def _summary(left: Sequence[Remaining], workers: int) -> str:
    if not left:
        return "Nothing is left to do."
    frames = sum(each.frames for each in left)
    return (
        f"To be done: {counted(len(left), 'shot')}, {counted(frames, 'frame')}; {_time(duration(left, workers))} with "
        f"{workers} at a time; the longest alone takes {_time(left[0].seconds)}."
    )


def _as_dict(left: Sequence[Remaining], workers: int) -> dict[str, Any]:
    return {
        "seconds": round(duration(left, workers), 1),
        "workers": workers,
        "shots": [
            {
                "name": each.shot.name,
                "frames": each.frames,
                "seconds": round(each.seconds, 1),
                "memory": each.memory,
                "basis": each.basis,
            }
            for each in left
        ],
    }


def _time(seconds: float) -> str:
    minutes = round(seconds / 60)
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def _gib(size: float) -> str:
    return f"{size / 2**30:.1f} GiB"


class _RaisingParser(argparse.ArgumentParser):
    """Raises what is wrong with a shot's options, instead of leaving."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(message)


def _check_arguments(arguments: Sequence[str]) -> None:
    """Raise ValueError unless ``smokelift reconstruct`` takes the arguments."""
    parser = _RaisingParser()
    parser.add_argument("--device", choices=("auto", "cpu", "gpu"))
    reconstruct.add_options(parser)
    parser.parse_args(arguments)


def _count(text: str) -> int:
    count = int(text) if text.isascii() and text.isdigit() else 0
    if not 0 < count < 100_000:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a number from 1")
    return count
