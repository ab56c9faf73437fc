"""``smokelift batch``: a list of shots, on this machine or on many."""

import argparse
import os
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, suppress
from typing import Any

import psutil

from smokelift.app.commands.clips import add_reconstruct_options
from smokelift.app.options import add_device, named_path, whole_number
from smokelift.app.progress import Reporter
from smokelift.batch.shots import (
    BatchShot,
    Record,
    Remaining,
    duration,
    read_record,
    read_shots,
    remaining_work,
    write_report,
)
from smokelift.batch.work import ShotMemory, Task, finish_shot, inspect_shot, run_here
from smokelift.checks import counted
from smokelift.report.cost import memory_free

MEMORY_FRACTION = 0.9
"""Part of the free memory that shots may take together: forecasts are right to a tenth or two."""

MAX_WORKERS = 99_999
"""Largest number of shots at a time: more than any cluster takes."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("list", type=named_path, help="list of shots, such as shots.toml")
    parser.add_argument("--plan", action="store_true", help="say only what is left and how long it will take")
    parser.add_argument(
        "--workers",
        type=whole_number(1, MAX_WORKERS),
        default=os.cpu_count() or 1,
        metavar="N",
        help="run N shots at a time at most (default: one a processor core)",
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="run on a Dask cluster, as tcp://host:8786 (needs the extra [cluster])"
    )


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Run the shots that are not finished; ValueError if the list is wrong, or, at the end, if a shot failed."""
    of_a_shot = argparse.ArgumentParser(exit_on_error=False)
    add_device(of_a_shot)
    add_reconstruct_options(of_a_shot)
    records = {shot: read_record(shot) for shot in read_shots(options.list, of_a_shot)}
    unknown = {shot: 0 for shot, record in records.items() if record.forecast is None}
    if unknown:
        say.note(f"Inspecting {counted(len(unknown), 'clip')} ...")
    with closing(_run_shots(options.scheduler, unknown, inspect_shot, say.note, 1)) as inspected:
        for shot, record in inspected:
            records[shot] = record
            if record.forecast is None:
                say.note(f"{shot.name}: {record.sentence}")
    left = remaining_work(records)
    for line in _forecast_lines(left, options.workers):
        say.note(line)
    if options.plan:
        say.finish(_summary(left, options.workers), _as_dict(left, options.workers))
    else:
        _run_remaining(options, say, records, left)


def _run_remaining(
    options: argparse.Namespace, say: Reporter, records: dict[BatchShot, Record], left: Sequence[Remaining]
) -> None:
    """Run what is left and keep the report up to date; ValueError, at the end, if a shot failed."""
    page = next(iter(records)).folder / "report.html"

    def work(shot: BatchShot, stop: threading.Event) -> Record:
        say.note(f"{shot.name}: begins.")
        return finish_shot(shot, stop, say.note)

    total = psutil.virtual_memory().total
    shots = {}
    for each in left:
        if options.scheduler is None and each.memory > total:
            needs = f"needs {_gib(each.memory)} and this machine has {_gib(total)}"
            say.note(f"{each.shot.name}: {needs}; choose a lower resolution.")
        else:
            shots[each.shot] = each.memory
    task = finish_shot if options.scheduler is not None else work
    with closing(_run_shots(options.scheduler, shots, task, say.note, options.workers)) as ended:
        for shot, record in ended:
            records[shot] = record
            say.note(f"{shot.name}: {record.status}. {record.sentence}")
            with suppress(OSError):  # the storage may be full for a while; the next shot updates the page
                write_report(page, options.list.stem, records)
    write_report(page, options.list.stem, records)
    missing = [shot.name for shot, record in records.items() if record.status != "done"]
    if missing:
        raise ValueError(
            f"{len(missing)} of {counted(len(records), 'shot')} did not come to the end ({', '.join(missing)}); {page} "
            "says why. Give the same command again to go on."
        )
    say.finish(
        f"Finished: {counted(len(records), 'shot')}; {page} shows the result.",
        {"report": str(page), "shots": [str(shot.directory) for shot in records]},
    )


def _run_shots(
    scheduler: str | None, shots: ShotMemory, task: Task, say: Callable[[str], None], workers: int
) -> Generator[tuple[BatchShot, Record], None, None]:
    """Run shots, here or on a cluster, and yield each at its end."""
    if scheduler is None:
        yield from run_here(shots, task, round(MEMORY_FRACTION * memory_free()), workers)
        return
    try:
        from smokelift.batch.cluster import run_on_cluster
    except ImportError as error:
        raise ValueError("--scheduler needs Dask: pip install 'smokelift[cluster]'.") from error
    yield from run_on_cluster(shots, task, scheduler, say)


def _forecast_lines(left: Sequence[Remaining], workers: int) -> Iterator[str]:
    """Lines on what is left: one for each shot, and one for each power of two of workers."""
    for each in left:
        memory = f"{_gib(each.memory)} of memory"
        yield f"{each.shot.name}: {counted(each.frames, 'frame')}, {_time(each.seconds)}, {memory} ({each.basis})"
    fewer = [2**n for n in range(workers.bit_length()) if 2**n < workers]
    for count in (*fewer, workers) if left else ():
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
    shots = [{"name": each.shot.name, **each._asdict(), "seconds": round(each.seconds, 1)} for each in left]
    for each in shots:
        del each["shot"]
    return {"seconds": round(duration(left, workers), 1), "workers": workers, "shots": shots}


def _time(seconds: float) -> str:
    minutes = round(seconds / 60)
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def _gib(size: float) -> str:
    return f"{size / 2**30:.1f} GiB"
