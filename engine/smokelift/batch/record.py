"""What is known of a shot besides its sequence, in a file of its own beside it: ``NAME.json``.

The sequence itself says which frames are finished. The record says whether the shot is, and what it took.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

from smokelift.batch.shots import BatchShot
from smokelift.output.atomic import atomic_path
from smokelift.output.index import Index, SequenceError

Status = Literal["waiting", "running", "done", "refused", "crashed", "stuck", "cancelled"]
"""``running``: or its machine was lost while it ran; ``refused``: the engine says what is wrong; ``stuck``: what passes
(a full disk, say) did not pass in time."""


_MASK = "--mask="
"""What a shot's option for a mask begins with."""


@dataclass(frozen=True)
class Forecast:
    """What ``smokelift inspect`` foretells of a shot: its frames, seconds, and bytes of memory at the peak."""

    frames: int
    seconds: float
    memory: int


@dataclass(frozen=True)
class Record:
    """What is known of a shot.

    Attributes
    ----------
    of
        Options, size and time of change of the input and of its mask, when it was last run.
    status, sentence
        How its last run ended, and what the engine said then.
    notes
        What the engine assumed and noticed.
    runs
        How often the engine was started for it.
    seconds, processor_seconds
        Of all its runs.
    memory
        Bytes at the peak, as measured.
    machine
        Where it ran last.
    forecast
        None before the clip was inspected.
    """

    of: dict[str, Any]
    status: Status = "waiting"
    sentence: str = ""
    notes: tuple[str, ...] = ()
    runs: int = 0
    seconds: float = 0.0
    processor_seconds: float = 0.0
    memory: int = 0
    machine: str = ""
    forecast: Forecast | None = None

    def write(self, shot: BatchShot) -> None:
        """Write the file; OSError if that fails."""
        with atomic_path(_path(shot)) as aside:
            aside.write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")


@dataclass(frozen=True)
class Frames:
    """The finished frames of a shot.

    How many, whether these are all, the seconds that were spent on each, and the PSNR in dB of those with smoke.
    """

    count: int = 0
    complete: bool = False
    seconds: list[float] = field(default_factory=list)
    psnr: list[float] = field(default_factory=list)


class ShotState(NamedTuple):
    """A shot with its record and its finished frames, as they are on the storage."""

    shot: BatchShot
    record: Record
    frames: Frames

    @property
    def finished(self) -> bool:
        """Whether the shot need not be run again."""
        return self.record.status == "done" and self.frames.complete


def read_state(shot: BatchShot) -> ShotState:
    """Read what the storage has of a shot as it is now listed."""
    return ShotState(shot, read_record(shot), finished_frames(shot))


def read_record(shot: BatchShot) -> Record:
    """Return the record of a shot as it is now listed; a new one if its options or its input have changed."""
    fresh = Record(of=_identity(shot))
    with suppress(OSError, ValueError, TypeError, AttributeError):  # a damaged record is none
        data = json.loads(_path(shot).read_text(encoding="utf-8"))
        forecast = data.pop("forecast")
        record = Record(**{**data, "notes": tuple(data["notes"])})
        if record.of == fresh.of:
            return replace(record, forecast=Forecast(**forecast) if forecast else None)
    return fresh


def finished_frames(shot: BatchShot) -> Frames:
    """Return what the shot's sequence says of its frames; none if there is no sequence."""
    try:
        index = Index.read(shot.directory)
    except SequenceError:
        return Frames()
    figures = list(index.frames.values())
    seconds = [float(of.get("seconds_density") or 0) + float(of.get("seconds_velocity") or 0) for of in figures]
    psnr = [float(of["psnr"]) for of in figures if of.get("psnr") is not None]
    return Frames(len(figures), index.complete, seconds, psnr)


def _path(shot: BatchShot) -> Path:
    return shot.folder / f"{shot.name}.json"


def _identity(shot: BatchShot) -> dict[str, Any]:
    """What a shot is a reconstruction of, as JSON holds it."""
    identity: dict[str, Any] = {"options": list(shot.options), "input": None}
    files = [("input", shot.input)]
    files += [("mask", Path(word.removeprefix(_MASK))) for word in shot.options if word.startswith(_MASK)]
    for name, path in files:
        with suppress(OSError):  # a pattern of pictures is no file; the engine says if there are none
            stat = path.stat()
            identity[name] = [stat.st_size, stat.st_mtime_ns]
    return identity
