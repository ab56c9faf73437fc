"""One run of the engine as a process of its own, so that a crash loses one shot and no more."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import psutil

ENGINE = (sys.executable, "-m", "smokelift_command.tethered")
"""The command line, which ends with the process that started it."""

POLL_SECONDS = 0.25
"""Between two checks of a running engine, at most."""

GRACE_SECONDS = 20.0
"""Time for a cancelled engine to end; it kills itself before that."""


@dataclass
class EngineResult:
    """How a run of the engine ended, and what it took.

    Attributes
    ----------
    status
        Its exit status; less than 0 if a signal ended it.
    sentence
        What it said last: its result or why there is none.
    retryable
        Whether the same command may succeed later: the disk is full, say.
    details
        Of its result.
    notes
        What it assumed and noticed.
    seconds, processor_seconds, memory
        What it took; bytes at the peak.
    """

    status: int = 0
    sentence: str = ""
    retryable: bool = False
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0
    processor_seconds: float = 0.0
    memory: int = 0


def run_engine(
    arguments: Sequence[str], stop: threading.Event, log: Path, engine: Sequence[str] = ENGINE
) -> EngineResult:
    """Run the engine to its end, with arguments of ``smokelift``.

    `stop` ends the run once it is set; finished frames stay. All that the engine says is appended to the file `log`;
    what cannot be written there is left out. It raises OSError if the engine cannot be started.
    """
    began = time.monotonic()
    result = EngineResult()
    with ExitStack() as open_files:
        kept: IO[bytes] | None = None
        with suppress(OSError):
            kept = open_files.enter_context(log.open("ab", buffering=0))
        process = open_files.enter_context(
            subprocess.Popen(
                [*engine, *arguments, "--progress", "json"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
        )
        try:
            _follow(process, result, stop, kept)
        finally:
            process.kill()  # nothing, unless we are interrupted ourselves
    result.status = process.returncode
    result.seconds = time.monotonic() - began
    return result


def _follow(
    process: subprocess.Popen[bytes], result: EngineResult, stop: threading.Event, log: IO[bytes] | None
) -> None:
    """Read what a process says, and measure it, until it has ended."""
    assert process.stdin is not None and process.stdout is not None
    lines: queue.Queue[bytes | None] = queue.Queue()
    threading.Thread(target=_read, args=(process.stdout, lines), daemon=True).start()
    last_words: deque[str] = deque(maxlen=1)
    kill_at = float("inf")
    while True:
        with suppress(queue.Empty):
            line = lines.get(timeout=POLL_SECONDS)
            if line is None:
                break
            if log is not None:
                with suppress(OSError):
                    log.write(line)
            _read_message(line, result, last_words)
        _measure(process, result)
        if stop.is_set() and kill_at == float("inf"):
            kill_at = time.monotonic() + GRACE_SECONDS
            with suppress(OSError):  # it has ended already
                process.stdin.close()
        if time.monotonic() > kill_at:
            process.kill()
    process.wait()
    if not result.sentence:
        signal = f"signal {-process.returncode}" if process.returncode < 0 else f"status {process.returncode}"
        result.sentence = f"The engine ended by itself ({signal}): {' '.join(last_words) or 'it said nothing'}"


def _read(output: IO[bytes], lines: queue.Queue[bytes | None]) -> None:
    with suppress(OSError, ValueError):
        for line in output:
            lines.put(line)
    lines.put(None)


def _read_message(line: bytes, result: EngineResult, last_words: deque[str]) -> None:
    text = line.decode("utf-8", "replace").strip()
    try:
        message = json.loads(text)
        event = message.pop("event")
    except (ValueError, AttributeError, LookupError, TypeError):
        if text:
            last_words.append(text)
        return
    if event == "note":
        result.notes.append(str(message["text"]))
    elif event in ("done", "error"):
        result.sentence = str(message["text"])
        result.details = message
        result.retryable = bool(message.get("later"))


def _measure(process: subprocess.Popen[bytes], result: EngineResult) -> None:
    with suppress(psutil.Error):  # it has ended already
        seen = psutil.Process(process.pid)
        result.memory = max(result.memory, seen.memory_info().rss)
        times = seen.cpu_times()
        result.processor_seconds = max(result.processor_seconds, times.user + times.system)
