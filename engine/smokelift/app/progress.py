"""What a command says while it runs: a bar for people, one JSON object per line for programs."""

import errno
import json
import os
import sys
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from statistics import fmean
from typing import Any, Self, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from smokelift.checks import Figures, Finding, printable
from smokelift.output.index import median_psnr, work_seconds
from smokelift.output.sequence import Sequence
from smokelift.report.sentences import message

Made = TypeVar("Made")
Shown = Callable[[], Mapping[str, Any]]

FORECAST_FRAMES = 10
"""Newest frames by whose seconds the rest is forecast. The forecast before the first counts as one of them until that
many are there: so it hardly matters after a few, and one slow frame is not taken for all."""


class OutputError(OSError):
    """Standard output takes nothing more; ``closed`` if its reader has gone."""

    def __init__(self, error: OSError) -> None:
        super().__init__(f"Standard output cannot be written: {error.strerror}.")
        # Windows calls it an invalid argument
        self.closed = isinstance(error, BrokenPipeError) or (sys.platform == "win32" and error.errno == errno.EINVAL)


def printable_lines(text: str) -> str:
    """Return a text with its control characters, which a terminal would obey, spelt out; line breaks stay."""
    return "\n".join(map(printable, text.split("\n")))


class _Console(Console):
    """Raises the error of a closed pipe, where Rich would leave with status 1."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


@contextmanager
def _output() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OutputError(error) from error


class Reporter:
    """Says what happens to people; a context manager around the frames, whose bar ends with it."""

    def __init__(self) -> None:
        self._console = _Console(highlight=False)
        self._errors = _Console(stderr=True, highlight=False)
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[fit]}"),
            console=self._console,
            speed_estimate_period=120,
        )
        self._shown: list[Mapping[str, Any]] = []
        self._task = self._bar.add_task("frames", start=False, fit="")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._end_bar()

    def _end_bar(self) -> None:
        with _output():
            if self._bar.live.is_started:  # else the bar would leave an empty line
                self._bar.stop()

    def note(self, said: Finding | str) -> None:
        """Say something that was assumed or noticed."""
        with _output():
            self._console.print(printable_lines(_fields(said)["text"]), markup=False, soft_wrap=True)

    def start(self, total: int, done: int, seconds: float | None = None, shown: Shown = dict) -> None:
        """Say that frames begin: ``total`` of them, ``done`` already.

        ``seconds`` is a forecast of the rest, if there is one; ``shown`` gives what else a program shows of the shot.
        """
        with _output():
            self._bar.update(self._task, total=total, completed=done)
            self._bar.start_task(self._task)
            self._bar.start()

    def frame(self, number: int, figures: Mapping[str, Any]) -> None:
        """Say that one more frame is finished."""
        fit = figures.get("origin", "no smoke")
        if "psnr" in figures:  # the last fit stays on the screen, so it is the median of the run
            self._shown.append(figures)
            fit = f"fit {median_psnr(self._shown):.1f} dB"
        with _output():
            self._bar.update(self._task, advance=1, fit=fit)

    def finish(self, said: Finding | str, details: Mapping[str, Any]) -> None:
        """Say that the job is done; the details are for programs."""
        self._end_bar()
        self.note(said)

    def fail(self, text: str, status: int, retryable: bool = False) -> None:
        """Say that the job failed; ``retryable`` if the same command may succeed later."""
        self._end_bar()
        self._errors.print(printable(text), markup=False, soft_wrap=True)


class JsonReporter(Reporter):
    """Events ``note``, ``start``, ``frame``, ``done`` and ``error`` for programs, one per line.

    What is said has its ``text``; a finding has its ``kind`` and ``figures`` too. A note says if it is a ``doubt``.
    """

    def __init__(self) -> None:
        self._total = self._done = 0
        self._seconds: deque[float] = deque(maxlen=FORECAST_FRAMES)
        self._before = time.monotonic()

    def _end_bar(self) -> None:
        """There is none."""

    def note(self, said: Finding | str) -> None:
        self._say("note", **_fields(said), doubt=isinstance(said, Finding) and said.doubt)

    def start(self, total: int, done: int, seconds: float | None = None, shown: Shown = dict) -> None:
        self._total, self._done = total, done
        known = {}
        if seconds is not None and total > done:
            self._seconds.append(seconds / (total - done))
            known = {"seconds_left": round(seconds, 1)}
        self._say("start", total=total, done=done, **known, **shown())
        self._before = time.monotonic()

    def frame(self, number: int, figures: Mapping[str, Any]) -> None:
        self._done += 1
        now = time.monotonic()
        # all that passed, with the files; of a first frame that was under way at the start, what it says itself
        self._seconds.append(max(now - self._before, work_seconds(figures)))
        self._before = now
        left = round((self._total - self._done) * fmean(self._seconds), 1)
        done, total = self._done, self._total
        self._say("frame", frame=number, done=done, total=total, seconds_left=left, figures=dict(figures))

    def finish(self, said: Finding | str, details: Mapping[str, Any]) -> None:
        self._say("done", **_fields(said), **details)

    def fail(self, text: str, status: int, retryable: bool = False) -> None:
        self._say("error", text=text, status=status, later=retryable)

    def _say(self, event: str, **fields: Any) -> None:
        with _output():
            # in one piece, since shots of a batch speak side by side
            print(json.dumps({"event": event, **fields}) + "\n", end="", flush=True)


def _fields(said: Finding | str) -> dict[str, Any]:
    return {"text": said} if isinstance(said, str) else message(said)


def say_sequence(
    say: Reporter,
    written: Iterable[tuple[int, Mapping[str, Any]]],
    *,
    kind: str,
    directory: Path,
    start: int = 1,
    total: int,
    **figures: float,
) -> None:
    """Say every frame of a sequence while it is written, the first number being ``start``; and how it ends.

    The last sentence is a finding of ``kind`` with ``figures`` of its own.
    """
    began, new = time.monotonic(), set[int]()
    for number, of_frame in written:
        if not new:
            say.start(total, number - start)
        new.add(number)
        say.frame(number, of_frame)
    earlier = seconds_before(Sequence.open(directory), new) if min(new, default=start) > start else 0.0
    seconds = round(time.monotonic() - began + earlier, 1)
    result: Figures = {"directory": str(directory), "frames": total, "seconds": seconds}
    say.finish(Finding(kind, {**result, **figures}), result)


def say_frames(say: Reporter, made: Iterable[tuple[int, Made]], total: int, origin: str) -> list[Made]:
    """Say a frame, by its number, with the time that it took, for each thing that is made of one; return the things."""
    say.start(total, 0)
    things, before = [], time.monotonic()
    for number, thing in made:
        now = time.monotonic()
        say.frame(number, {"origin": origin, "seconds_density": now - before, "seconds_velocity": 0.0})
        things.append(thing)
        before = now
    return things


def seconds_before(sequence: Sequence, new: Collection[int]) -> float:
    """Return what the frames of a sequence took that a run found finished; ``new`` are the numbers of its own."""
    return sum(work_seconds(sequence.figures(number)) for number in sequence.frames if number not in new)
