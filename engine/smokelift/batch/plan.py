"""What a batch still takes on so many workers, and its page: a row per shot, with its picture."""

import heapq
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from statistics import fmean, median
from typing import NamedTuple
from urllib.parse import quote

from smokelift.batch.shots import BatchShot
from smokelift.batch.work import Record, is_finished, read_index
from smokelift.checks import counted
from smokelift.checks.whole_files import write_text
from smokelift.output.index import median_psnr, work_seconds

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
