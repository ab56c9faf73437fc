"""Runs a command in a fork of this process, which has loaded the engine, and says what is wrong with how it ended.

The fork saves the engine's second for every case. A command may end well, or with one line and a status.
"""

import faulthandler
import gc
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

CRASHED = 70
"""Status of an exception that the command does not handle (EX_SOFTWARE)."""


STATUSES = (0, 2, 3, 130)
"""Done, bad input, device or memory, cancelled."""

PROCESSOR_SECONDS, SECONDS, MEMORY = 30, 600.0, 6 * 2**30
"""Seconds of processor time, seconds in all, and bytes of address space that a case may take."""


@dataclass(frozen=True)
class Ended:
    """How a command ended: its status (negative: by that signal), what it said, and whether it was stopped."""

    status: int
    output: str
    errors: str
    hung: bool


def nothing() -> None:
    """Do nothing."""


def run(
    command: Callable[[Sequence[str]], int],
    words: Sequence[str],
    folder: Path,
    begin: Callable[[], None] = nothing,
    seconds: float = SECONDS,
) -> Ended:
    """Run a command in a fork of this process.

    Parameters
    ----------
    command
        Takes the words and returns the status; for example `smokelift.app.cli.main`.
    words
        Of the command line.
    folder
        Working directory; standard output and error are kept beside it.
    begin
        Done in the fork before the command.
    seconds
        A command that takes more is stopped.
    """
    spoken = [folder.with_name(f"{folder.name}.{name}") for name in ("out", "err")]
    child = os.fork()
    if child == 0:
        status = CRASHED
        gc.freeze()  # what the parent left to its collector may wait for threads, which a fork has not
        try:
            for number, path in enumerate(spoken, 1):
                os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
            faulthandler.disable()
            sys.stdout, sys.stderr = (os.fdopen(n, "w", encoding="utf-8", closefd=False) for n in (1, 2))
            resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR_SECONDS, PROCESSOR_SECONDS + 5))
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            os.chdir(folder)
            begin()
            status = command(words)
        except SystemExit as leaving:
            status = leaving.code if isinstance(leaving.code, int) else CRASHED
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    status, hung = _wait(child, seconds)
    output, errors = (path.read_text(encoding="utf-8", errors="replace") for path in spoken)
    return Ended(status, output, errors, hung or status in (-signal.SIGXCPU, -signal.SIGKILL))


def files_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of everything below a folder."""
    return {
        str(path.relative_to(folder)): (path.lstat().st_size, path.lstat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
        if not path.is_dir()
    }


def verdict(ended: Ended, before: Mapping[str, object], after: Mapping[str, object], out: str) -> str:
    """Return in a word what is wrong with how a command ended; "" if nothing is.

    Parameters
    ----------
    before, after
        `files_of` its folder.
    out
        Beginning of the names that it may write.
    """
    if ended.hung:
        return "hung"
    if "Traceback" in ended.errors:
        return "traceback"
    if ended.status < 0:
        return "signal"
    if ended.status not in STATUSES:
        return "status"
    if ended.status and len(ended.errors.strip().splitlines()) != 1:
        return "not one line"
    touched = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    return "other files" if any(not name.startswith(out) for name in touched) else ""


def _wait(child: int, seconds: float) -> tuple[int, bool]:
    """Status of a process, and whether it had to be stopped."""
    began = time.monotonic()
    while time.monotonic() - began < seconds:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status), False
        time.sleep(0.005)
    os.kill(child, signal.SIGKILL)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), True
