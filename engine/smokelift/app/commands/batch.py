"""``smokelift batch``: a list of shots, on this machine or on many; what is left of it, and its page."""

import argparse
import heapq
import os
import threading
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from html import escape
from pathlib import Path
from statistics import fmean, median
from typing import Any, NamedTuple
from urllib.parse import quote

import psutil

from smokelift.app.commands.clips import add_reconstruct_options
from smokelift.app.options import add_device, named_path, whole_number
from smokelift.app.progress import Reporter
from smokelift.batch.shots import BatchShot, Record, is_finished, read_index, read_record, read_shots
from smokelift.batch.work import ShotMemory, Task, finish_shot, inspect_shot, run_here
from smokelift.checks import counted
from smokelift.checks.whole_files import write_text
from smokelift.output.index import median_psnr, work_seconds
from smokelift.report.cost import memory_free

MEMORY_FRACTION = 0.9
"""Part of the free memory that shots may take together: forecasts are right to a tenth or two."""

MAX_WORKERS = 99_999
"""Largest number of shots at a time: more than any cluster takes."""


_STYLE = """
body { background: #1a1a1c; color: #e8e8e8; font: 15px sans-serif; margin: 1.5em }
table { border-collapse: collapse }
tr { border-top: 1px solid #333 }
td, th { padding: .4em 1.2em .4em 0; vertical-align: top; text-align: left }
img { height: 12em; max-width: 24em; object-fit: contain }
.refused, .crashed, .stuck { color: #ffaa46 }
.done { color: #8fd18f }
"""

_HEADINGS = ("clip and smoke", "shot", "state", "frames", "fit (dB)", "time (s)", "memory (GiB)", "what was said")


class Remaining(NamedTuple):
    """What is left of a shot: how many frames, their seconds, and bytes at the peak, as measured or foretold.

    The basis is ``"measured"``: from the seconds of the shot's own frames; ``"scaled"``: as foretold, times what other
    shots of the batch took over what was foretold of them; or ``"foretold"``, where nothing was measured yet.
    """

    shot: BatchShot
    frames: int
    seconds: float
    memory: int
    basis: str


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("list", type=named_path, help="list of shots, such as shots.toml")
    parser.add_argument("--plan", action="store_true", help="say only what is left and how long it will take")
    parser.add_argument(
        "--workers",
        type=whole_number(1, MAX_WORKERS),
        default=os.cpu_count() or 1,
        metavar="N",
        help="run N shots at a time at most (default: one per processor core)",
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
        say.finish(*_plan(left, options.workers))
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


def _plan(left: Sequence[Remaining], workers: int) -> tuple[str, dict[str, Any]]:
    """What is left in a sentence, and for programs."""
    seconds = duration(left, workers)
    shots = [{"name": each.shot.name, **each._asdict(), "seconds": round(each.seconds, 1)} for each in left]
    for each in shots:
        del each["shot"]
    known = {"seconds": round(seconds, 1), "workers": workers, "shots": shots}
    if not left:
        return "Nothing is left to do.", known
    frames = counted(sum(each.frames for each in left), "frame")
    return (
        f"To be done: {counted(len(left), 'shot')}, {frames}; {_time(seconds)} with {workers} at a time; the longest "
        f"alone takes {_time(left[0].seconds)}."
    ), known


def _time(seconds: float) -> str:
    minutes = round(seconds / 60)
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def _gib(size: float) -> str:
    return f"{size / 2**30:.1f} GiB"


def remaining_work(records: Mapping[BatchShot, Record]) -> tuple[Remaining, ...]:
    """Return what is left of each shot that is not finished and whose clip was inspected, longest first."""
    known = {shot: (record.forecast, read_index(shot).frames) for shot, record in records.items() if record.forecast}
    foretold = {shot: forecast["seconds"] / max(1, forecast["frames"]) for shot, (forecast, _) in known.items()}
    measured = {shot: fmean(map(work_seconds, frames.values())) for shot, (_, frames) in known.items() if frames}
    ratios = [seconds / foretold[shot] for shot, seconds in measured.items() if foretold[shot] > 0]
    scale = median(ratios) if ratios else 1.0
    left = []
    for shot, (forecast, frames) in known.items():
        if not is_finished(shot, records[shot]):
            missing = max(0, forecast["frames"] - len(frames))
            basis = "measured" if shot in measured else "scaled" if ratios else "foretold"
            seconds = missing * measured.get(shot, scale * foretold[shot])
            left.append(Remaining(shot, missing, seconds, max(forecast["memory"], records[shot].memory), basis))
    return tuple(sorted(left, key=lambda each: -each.seconds))


def duration(left: Sequence[Remaining], workers: int) -> float:
    """Return the seconds that so many workers take, a shot at a time each, the longest shots first.

    At most a third more than the best order (Graham, SIAM J. Appl. Math. 17, 1969, 416).
    """
    free_at = [0.0] * workers
    for each in left:
        heapq.heapreplace(free_at, free_at[0] + each.seconds)
    return max(free_at)


def write_report(path: Path, title: str, records: Mapping[BatchShot, Record]) -> None:
    """Write the page; OSError if that fails."""
    rows = "".join(f"<tr>{_cells(shot, record)}</tr>\n" for shot, record in records.items())
    counts = Counter(record.status for record in records.values()).most_common()
    text = (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body>\n<h1>{escape(title)}</h1>\n"
        f"<p>{counted(len(records), 'shot')}: {', '.join(f'{count} {status}' for status, count in counts)}.</p>\n"
        f"<table>\n<tr>{''.join(f'<th>{each}</th>' for each in _HEADINGS)}</tr>\n{rows}</table>\n</body></html>\n"
    )
    write_text(path, text)


def _cells(shot: BatchShot, record: Record) -> str:
    index, notes = read_index(shot), "".join(f"<p>{escape(note)}</p>" for note in record.notes)
    picture = shot.file("png")
    total = f" of {record.forecast['frames']}" if record.forecast is not None and not index.complete else ""
    psnr = median_psnr(index.frames.values())
    details = f"<details><summary>{counted(len(record.notes), 'note')}</summary>{notes}</details>" if notes else ""
    cells = (
        f'<img alt="clip and reconstruction" src="{quote(picture.name)}">' if picture.exists() else "",
        f"<b>{escape(shot.name)}</b><br>{escape(shot.input.name)}<br>{escape(' '.join(shot.options))}",
        f'<span class="{record.status}">{record.status}</span>',
        f"{len(index.frames)}{total}",
        "" if psnr is None else f"{psnr:.1f}",
        f"{record.seconds:.0f}" if record.seconds else "",
        f"{record.memory / 2**30:.1f}" if record.memory else "",
        escape(record.sentence) + details,
    )
    return "".join(f"<td>{cell}</td>" for cell in cells)
