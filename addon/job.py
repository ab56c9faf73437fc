"""Runs of the engine in child processes, one after the other. Knows nothing of Blender.

The engine says what it does in lines of JSON on its standard output; a thread reads them, so that looking never
waits. It ends when its standard input is closed: that is how it is cancelled, on every system, and what happens by
itself when Blender quits or crashes.
"""

from __future__ import annotations

import importlib.util
import json
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Literal

Outcome = Literal["waiting", "running", "done", "failed", "cancelled"]

LINES_A_POLL = 500
"""A flood of lines must not hold the caller up."""

LONGEST_LINE = 2**20
GRACE_SECONDS = 8.0
"""How long the engine may take to end by itself; it writes files whole, so a hard end does no harm."""

LAST_WORDS_SECONDS = 1.0
CANCELLED_STATUS = 130

# os.read, because a thread that waits in a buffered reader would hold its lock at the interpreter's end.
_START = """
import _thread, os, runpy, signal, sys, threading

def end_with_parent():
    while os.read(0, 4096):
        pass
    _thread.interrupt_main()

signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Thread(target=end_with_parent, daemon=True).start()
if hasattr(os, "nice"):
    os.nice(10)
sys.path.insert(0, sys.argv.pop(1))
runpy.run_module("smokelift", run_name="__main__", alter_sys=True)
"""


class EngineMissingError(RuntimeError):
    """The engine is not installed."""


def engine_command(arguments: Sequence[str]) -> list[str]:
    """The command that runs the engine with this Python, undisturbed by the user's own settings of Python.

    Raises
    ------
    EngineMissingError
        If there is no engine.
    """
    found = importlib.util.find_spec("smokelift")
    if found is None or found.origin is None:
        raise EngineMissingError("Smokelift's engine is missing: install the extension again.")
    site = Path(found.origin).parents[1]
    return [sys.executable, "-I", "-c", _START, str(site), *arguments]


class Job:
    """One run of the engine.

    Parameters
    ----------
    command
        What to start.
    log
        File that keeps everything that it says; appended to.

    Attributes
    ----------
    outcome
        How it stands.
    done, total
        Frames finished, and in all; 0 of 0 until the engine knows.
    seconds_left
        The engine's estimate; None while unknown.
    notes
        What was assumed or noticed, a sentence each.
    warnings
        Those of the notes that came with the frames: what is wrong with the result, not what was assumed before.
    sentence
        How it ended, or why it failed.
    details
        The fields of the engine's last word.
    status
        The engine's exit status, once it has ended: 0 done, 2 bad input, 3 device or memory, 130 cancelled.
    """

    def __init__(self, command: Sequence[str], log: Path) -> None:
        self.outcome: Outcome = "waiting"
        self.done = self.total = 0
        self.seconds_left: float | None = None
        self.notes: list[str] = []
        self.warnings: list[str] = []
        self.sentence = ""
        self.details: Mapping[str, Any] = {}
        self.status: int | None = None
        self._command = list(command)
        self._log_path = log
        self._log: IO[bytes] | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._lines: queue.Queue[bytes | None] = queue.Queue(4 * LINES_A_POLL)
        self._stop_at: float | None = None
        self._silent = False
        self._dead_since: float | None = None
        self._error = ""

    @property
    def ended(self) -> bool:
        """Whether nothing more will happen."""
        return self.outcome in ("done", "failed", "cancelled")

    @property
    def cancelling(self) -> bool:
        """Whether it was asked to end and has not yet."""
        return self._stop_at is not None and not self.ended

    def start(self) -> None:
        """Start the process; a failure to start is an outcome like others."""
        try:
            self._log_path.parent.mkdir(parents=True, exist_ok=True)
            self._log = self._log_path.open("ab", buffering=0)
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                creationflags=_quiet_flags(),
            )
        except OSError as error:
            self._close()
            self.outcome, self.sentence = "failed", f"The engine could not be started: {error}."
            return
        self.outcome = "running"
        assert self._process.stdout is not None
        threading.Thread(target=_read, args=(self._process.stdout, self._lines), daemon=True).start()

    def poll(self) -> bool:
        """Take in what the engine has said since; never waits. Returns whether anything changed."""
        if self.outcome != "running":
            return False
        assert self._process is not None
        changed = False
        for _ in range(LINES_A_POLL):
            try:
                line = self._lines.get_nowait()
            except queue.Empty:
                break
            if line is None:
                self._silent = True
                break
            changed = self._take(line) or changed
        if self._stop_at is not None and time.monotonic() > self._stop_at:
            self._process.kill()
        if self._process.poll() is not None:
            self._dead_since = self._dead_since or time.monotonic()
            # what it said last may be on its way still; a child of its own may hold the pipe open for ever
            if self._silent or (self._lines.empty() and time.monotonic() - self._dead_since > LAST_WORDS_SECONDS):
                self._end(self._process.returncode)
                return True
        return changed

    def cancel(self) -> None:
        """Ask the engine to end; finished frames stay."""
        if self.outcome == "waiting":
            self.outcome, self.sentence = "cancelled", "Cancelled before it began."
        elif self.outcome == "running" and self._stop_at is None:
            self._stop_at = time.monotonic() + GRACE_SECONDS
            self._close_input()

    def kill(self) -> None:
        """End the engine now, for when there is no time left; finished frames stay."""
        self.cancel()
        if self._process is not None and self.outcome == "running":
            self._process.kill()
            self._process.wait()
            with suppress(queue.Empty):  # the reader may wait for room
                while self._lines.get(timeout=0.2) is not None:
                    pass
            self._end(self._process.returncode)

    def _take(self, line: bytes) -> bool:
        """Understand one line; whatever is not a message is kept in the log."""
        text = line.decode("utf-8", "replace").rstrip()
        try:
            message = json.loads(text)
            event = message.pop("event")
        except (ValueError, AttributeError, LookupError, TypeError):
            self._note_down(text)
            return False
        try:
            return self._understand(event, message)
        except (LookupError, TypeError, ValueError):
            self._note_down(text)
            return False

    def _understand(self, event: str, message: dict[str, Any]) -> bool:
        match event:
            case "note":
                self.notes.append(str(message["text"]))
                if self.done:
                    self.warnings.append(self.notes[-1])
                self._note_down(self.notes[-1])
            case "start":
                self.done, self.total = int(message["done"]), int(message["total"])
            case "frame":
                self.done, self.total = int(message["done"]), int(message["total"])
                self.seconds_left = float(message["seconds_left"])
                self._note_down(f"frame {message['frame']}: {self.done} of {self.total}")
            case "done":
                self.sentence, self.details = str(message["text"]), message
                self._note_down(self.sentence)
            case "error":
                self._error = str(message["text"])
                self._note_down(self._error)
            case _:
                self._note_down(json.dumps({"event": event, **message}))
                return False
        return True

    def _end(self, status: int) -> None:
        self.status = status
        if status == 0:
            self.outcome = "done"
        elif self._stop_at is not None or status == CANCELLED_STATUS:
            self.outcome, self.sentence = "cancelled", f"Cancelled; {self.done} finished frames stay."
        else:
            self.outcome = "failed"
            self.sentence = self._error or self._last_words(status)
        self._note_down(f"[{self.outcome}, status {status}]")
        self._close()

    def _last_words(self, status: int) -> str:
        if status < 0 or status == 137:
            return f"The engine was ended from outside (signal {abs(status) % 128}), perhaps for lack of memory."
        try:
            lines = self._log_path.read_bytes()[-4096:].decode("utf-8", "replace").split("\n")
        except OSError:
            lines = []
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        return f"The engine stopped with an error of its own: {last or f'status {status}'}"

    def _note_down(self, text: str) -> None:
        if self._log is not None and text:
            with suppress(OSError):  # a full disk: the engine will say so itself
                self._log.write((text + "\n").encode("utf-8", "replace"))

    def _close_input(self) -> None:
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):  # it has ended already
                self._process.stdin.close()

    def _close(self) -> None:
        self._close_input()
        if self._log is not None:
            self._log.close()
            self._log = None


class Queue:
    """Jobs that run one after the other."""

    def __init__(self) -> None:
        self.jobs: list[Job] = []

    @property
    def current(self) -> Job | None:
        """The job that runs, or None."""
        return next((job for job in self.jobs if job.outcome == "running"), None)

    @property
    def ended(self) -> bool:
        """Whether all jobs have ended."""
        return all(job.ended for job in self.jobs)

    def add(self, job: Job) -> None:
        """Put a job at the end."""
        self.jobs.append(job)

    def poll(self) -> list[Job]:
        """Let time pass without waiting; returns the jobs that changed."""
        changed = [job for job in self.jobs if job.poll()]
        if self.current is None:
            waiting = next((job for job in self.jobs if job.outcome == "waiting"), None)
            if waiting is not None:
                waiting.start()
                changed.append(waiting)
        return changed

    def kill(self) -> None:
        """End everything now."""
        for job in reversed(self.jobs):
            job.kill()


def _read(stream: IO[bytes], lines: queue.Queue[bytes | None]) -> None:
    with stream:
        for line in iter(lambda: stream.readline(LONGEST_LINE), b""):
            lines.put(line)
    lines.put(None)


def _quiet_flags() -> int:
    """Without a console window on Windows, and behind what the user does."""
    if sys.platform == "win32":
        return subprocess.CREATE_NO_WINDOW | subprocess.BELOW_NORMAL_PRIORITY_CLASS
    return 0
