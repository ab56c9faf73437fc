"""The page of a batch: a row a shot, with its picture. HTML that needs no other file."""

from __future__ import annotations

import base64
import html
import statistics
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from smokelift.batch.record import Frames, Record, ShotState
from smokelift.batch.shots import BatchShot
from smokelift.checks import counted
from smokelift.output.atomic import atomic_path

REPORT = "report.html"

_STYLE = """
body { background: #1a1a1c; color: #e8e8e8; font: 15px sans-serif; margin: 1.5em }
th { text-align: left; color: #a5a5a5; font-weight: normal }
td, th { padding: .4em 1.2em .4em 0; vertical-align: top }
td.number { text-align: right; white-space: nowrap }
tr { border-top: 1px solid #333 }
table { border-collapse: collapse }
img { height: 12em; max-width: 24em; object-fit: contain }
.said { max-width: 36em; color: #a5a5a5 }
.refused, .crashed, .stuck { color: #ffaa46 }
.done { color: #8fd18f }
"""

_HEADINGS = ("clip and smoke", "shot", "state", "frames", "fit (dB)", "time (s)", "memory (GiB)", "what was said")


def write_report(folder: Path, title: str, states: Sequence[ShotState]) -> Path:
    """Write the page and return its path; OSError if that fails."""
    path = folder / REPORT
    rows = "".join(_row(*each) for each in states)
    heads = "".join(f"<th>{heading}</th>" for heading in _HEADINGS)
    counts = Counter(record.status for _, record, _ in states)
    summary = ", ".join(f"{count} {status}" for status, count in counts.most_common())
    text = (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body>\n<h1>{html.escape(title)}</h1>\n"
        f"<p>{counted(len(states), 'shot')}: {summary}.</p>\n"
        f"<table>\n<tr>{heads}</tr>\n{rows}</table>\n</body></html>\n"
    )
    with atomic_path(path) as aside:
        aside.write_text(text, encoding="utf-8")
    return path


def _row(shot: BatchShot, record: Record, frames: Frames) -> str:
    total = f" of {record.forecast.frames}" if record.forecast is not None and not frames.complete else ""
    numbers = (
        f"{frames.count}{total}",
        f"{statistics.median(frames.psnr):.1f}" if frames.psnr else "",
        f"{record.seconds:.0f}" if record.seconds else "",
        f"{record.memory / 2**30:.1f}" if record.memory else "",
    )
    named = (
        f"<b>{html.escape(shot.name)}</b><br>{html.escape(shot.input.name)}<br>{html.escape(' '.join(shot.options))}"
    )
    said = html.escape(record.sentence)
    if record.notes:
        notes = "".join(f"<p>{html.escape(note)}</p>" for note in record.notes)
        said += f"<details><summary>{counted(len(record.notes), 'note')}</summary>{notes}</details>"
    return (
        f"<tr><td>{_picture(shot.picture)}</td><td>{named}</td>"
        f'<td class="{record.status}">{record.status}</td>'
        + "".join(f'<td class="number">{number}</td>' for number in numbers)
        + f'<td class="said">{said}</td></tr>\n'
    )


def _picture(path: Path) -> str:
    with suppress(OSError):
        address = f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
        return f'<img alt="clip and reconstruction" src="{address}">'
    return ""
