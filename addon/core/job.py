"""A run of the engine in a child process.

The engine writes its progress to its standard output, one JSON object per line. A thread reads them, so polling never
waits. The engine ends when its standard input closes: so a job is cancelled on every system, and ends by itself when
Blender quits or crashes.
"""

import importlib.util
import json
import os
import platform
import queue
import subprocess
import sys
import sysconfig
import threading
import time
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Literal

from . import ShotError
from .contract import BLENDERS, CANCELLED, PLATFORMS, ZIP_FILE
from .sentences import REPLACED, advice, sentence, stopped

Outcome = Literal["waiting", "running", "done", "failed", "cancelled"]

HOME = Path(__file__).parents[1]  # the extension; the one with Taichi for the GPU lies beside it

LIBRARIES = f"python{sys.version_info.major}.{sys.version_info.minor}"
"""Folder of an extension that the engine imports from: what is compiled is for one version of Python."""

LINES_PER_POLL = 500  # lines read in one poll, at most, so that many lines do not delay the caller
LONGEST_LINE = 2**20  # bytes of a line, at most
GRACE_SECONDS = 8.0  # time for a cancelled engine to end by itself. It writes files whole, so killing it does no harm
DRAIN_SECONDS = 1.0  # time for the last lines after the engine's end; a child of its own may hold the pipe open

_QUIET = getattr(subprocess, "CREATE_NO_WINDOW", 0) | getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
"""Flags that give no console window and a low priority on Windows."""

_START = """
import os, runpy, sys

if hasattr(os, "nice"):
    os.nice(10)
sys.path[:0] = sys.argv.pop(1).split(os.pathsep)
runpy.run_module("smokelift_command.tethered", run_name="__main__", alter_sys=True)
"""


def engine_command(arguments: Sequence[str]) -> list[str]:
    """The command that runs the engine with this Python alone; ShotError if it is missing, or another Python's."""
    require_fitting_zip()
    shipped = [extension / LIBRARIES for extension in (HOME, HOME.with_name(f"{HOME.name}_gpu"))]
    found = importlib.util.find_spec("smokelift")
    if shipped[0].is_dir():
        folders = [folder for folder in shipped if folder.is_dir()]
    elif found is not None and found.origin is not None:
        folders = [Path(found.origin).parents[1]]
    else:
        raise ShotError("Smokelift's engine is missing: install the extension again.")
    return [sys.executable, "-I", "-c", _START, os.pathsep.join(map(str, folders)), *arguments]


def require_fitting_zip() -> None:
    """Refuse a zip for another Python or platform, which Blender installs silently; ShotError names the right one."""
    pythons = sorted(folder.name.removeprefix("python") for folder in HOME.glob("python3.*"))
    manifest = {}
    with suppress(OSError, ValueError):  # it runs without being installed
        manifest = tomllib.loads((HOME / "blender_manifest.toml").read_text(encoding="utf-8"))
    own_python = LIBRARIES.removeprefix("python")
    # what this Blender is compiled for: Windows on Arm also runs programs for x64, and tells them its own
    compiled = sysconfig.get_platform().rpartition("-")[2] if sys.platform == "win32" else platform.machine().lower()
    system = (sys.platform, compiled)
    own_platform = PLATFORMS.get(system, "-".join(system))
    platforms = manifest.get("platforms", [own_platform])
    if own_python in (pythons or [own_python]) and own_platform in platforms:
        return
    zip_is = " ".join([*platforms, *(f"with Python {python}" for python in pythons)])
    this = f"{own_platform} with Python {own_python}"
    if own_python not in BLENDERS or system not in PLATFORMS:
        raise ShotError(f"This zip is for {zip_is}, and this Blender is {this}, for which there is none.")
    names = {"blenders": BLENDERS[own_python], "platform": own_platform.replace("-", "_")}
    name = ZIP_FILE.format(version=manifest.get("version", "*"), **names)
    raise ShotError(f"This zip is for {zip_is}, and this Blender is {this}: install {name}.")


class Job:
    """One run of the engine by a command, all of whose messages are appended to a log.

    ``before`` is the number of the clip's frames before the first of the result, ``done`` of those that a resumed run
    has finished already.
    """

    def __init__(self, command: Sequence[str], log: Path, before: int = 0, done: int = 0) -> None:
        self.outcome: Outcome = "waiting"
        self.done, self.total = done, 0  # finished frames and all frames; 0 of 0 while unknown
        self.seconds_left: float | None = None  # the engine's estimate; None while unknown
        self.notes: list[str] = []  # the engine's assumptions and warnings, a sentence each
        # why the result may be nothing, or wrong, each after the engine's name for it; what helps is left out
        self.doubts: list[tuple[str, str]] = []
        # what a run says of its shot before its first frame, with the doubts of then; None before it does
        self.forecast: tuple[Mapping[str, Any], list[tuple[str, str]]] | None = None
        self.sentence = ""  # the result, or the reason of a failure
        self.details: Mapping[str, Any] = {}  # the fields of the engine's "done" message
        self.status: int | None = None  # the engine's exit status; None before it ends
        self.grace_seconds, self.drain_seconds = GRACE_SECONDS, DRAIN_SECONDS
        self._command = list(command)
        self._log_path = log
        self._before = before
        self._log: IO[bytes] | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._lines: queue.Queue[bytes | None] = queue.Queue(4 * LINES_PER_POLL)
        self._kill_at: float | None = None
        self._output_ended = False
        self._exited_at: float | None = None
        self._error = ""

    @property
    def ended(self) -> bool:
        """Whether its state is final."""
        return self.outcome in ("done", "failed", "cancelled")

    @property
    def stopping(self) -> bool:
        """Whether it was cancelled, and its engine has not ended yet."""
        return self._kill_at is not None and not self.ended

    def start(self) -> None:
        """Start the process; a failure to start is an outcome too."""
        try:
            self._log_path.parent.mkdir(parents=True, exist_ok=True)
            self._log = self._log_path.open("ab", buffering=0)
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, creationflags=_QUIET
            )
        except OSError as error:
            self._close()
            self.outcome, self.sentence = "failed", f"The engine could not be started: {error}."
            return
        self.outcome = "running"
        assert self._process.stdout is not None
        threading.Thread(target=_read, args=(self._process.stdout, self._lines), daemon=True).start()

    def poll(self) -> bool:
        """Read the engine's new messages, without waiting; returns whether anything changed."""
        if self.outcome != "running":
            return False
        assert self._process is not None
        changed = False
        with suppress(queue.Empty):
            for _ in range(LINES_PER_POLL):
                line = self._lines.get_nowait()
                if line is None:
                    self._output_ended = True
                    break
                changed = self._read_line(line) or changed
        if self._kill_at is not None and time.monotonic() > self._kill_at:
            self._process.kill()
        if self._process.poll() is not None:
            self._exited_at = self._exited_at or time.monotonic()
            if self._output_ended or (self._lines.empty() and time.monotonic() - self._exited_at > self.drain_seconds):
                self._end(self._process.returncode)
                return True
        return changed

    def cancel(self) -> None:
        """Ask the engine to end; finished frames stay."""
        if self.outcome == "waiting":
            self.outcome, self.sentence = "cancelled", "Cancelled before it began."
        elif self.outcome == "running" and self._kill_at is None:
            self._kill_at = time.monotonic() + self.grace_seconds
            self._close_input()

    def kill(self) -> None:
        """End the engine at once; finished frames stay."""
        self.cancel()
        if self._process is not None and self.outcome == "running":
            self._process.kill()
            self._process.wait()
            with suppress(queue.Empty):  # the reader may wait for room in the queue
                while self._lines.get(timeout=0.2) is not None:
                    pass
            self._end(self._process.returncode)

    def _read_line(self, line: bytes) -> bool:
        """Handle one line; what is no message goes to the log."""
        text = line.decode("utf-8", "replace").rstrip()
        try:
            message = json.loads(text)
            return self._handle(message.pop("event"), message)
        except (AttributeError, LookupError, TypeError, ValueError):
            self._write_log(text)
            return False

    def _handle(self, event: str, message: dict[str, Any]) -> bool:
        match event:
            case "note":
                kind, words = str(message.get("kind", "")), sentence(message, self._before)
                self.notes.append(f"{words} {advice(kind)}".strip())
                if message.get("doubt"):
                    before = [each for each in self.doubts if kind not in REPLACED.get(each[0], ())]
                    self.doubts = [*before, (kind, words)]
                self._write_log(self.notes[-1])
            case "start" | "frame":
                self.done, self.total = int(message["done"]), int(message["total"])
                if "qualities" in message:
                    self.forecast = message, self.doubts
                if "seconds_left" in message:
                    self.seconds_left = float(message["seconds_left"])
                if event == "frame":
                    number = self._before + int(message["frame"])
                    self._write_log(f"frame {number}: {self.done} of {self.total}")
            case "done":
                self.sentence = sentence(message, self._before, [kind for kind, _ in self.doubts])
                self.details = message
                self._write_log(self.sentence)
            case "error":
                self._error = str(message["text"])
                self._write_log(self._error)
            case _:
                self._write_log(json.dumps({"event": event, **message}))
                return False
        return True

    def _end(self, status: int) -> None:
        self.status = status
        if status == 0:
            self.outcome = "done"
        elif self._kill_at is not None or status == CANCELLED:
            self.outcome, self.sentence = "cancelled", stopped(self.done)
        else:
            self.outcome = "failed"
            self.sentence = self._error or self._failure_reason(status)
        self._write_log(f"[{self.outcome}, status {status}]")
        self._close()

    def _failure_reason(self, status: int) -> str:
        if status < 0 or status == 137:
            return (
                f"The engine was ended from outside (signal {abs(status) % 128}), perhaps for lack of memory: choose a "
                "lower quality."
            )
        last = ""
        with suppress(OSError):
            last = self._log_path.read_bytes()[-4096:].decode("utf-8", "replace").strip().rpartition("\n")[2].strip()
        return f"The engine stopped with an error of its own: {last or f'status {status}'}"

    def _write_log(self, text: str) -> None:
        if self._log is not None and text:
            with suppress(OSError):  # the engine itself reports a full disk
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


def _read(stream: IO[bytes], lines: queue.Queue[bytes | None]) -> None:
    with stream:
        for line in iter(lambda: stream.readline(LONGEST_LINE), b""):
            lines.put(line)
    lines.put(None)
