"""Where a command's words go: closed pipes, full disks, poor encodings, hostile names, and signals at any time."""

import errno
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from command_line import ENVIRONMENT, command, refused

from smokelift.app.progress import printable_lines
from smokelift.output.index import SequenceError
from smokelift.render import DeviceError, device

MISSING = ("inspect", "missing.toml")


def ended_python(code: str) -> tuple[int, bytes]:
    """Status and standard error of some lines of Python in a process of their own."""
    done = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, capture_output=True, timeout=60, check=False)
    return done.returncode, done.stderr


def test_a_closed_pipe_cancels_and_a_full_disk_is_bad_output(capsys, monkeypatch) -> None:
    """In one sentence, also when the stream is closed with what it still holds."""
    read, write = os.pipe()
    os.close(read)
    streams = [(write, 130, "Broken pipe")]
    if Path("/dev/full").exists():
        streams.append((os.open("/dev/full", os.O_WRONLY), 2, os.strerror(errno.ENOSPC)))
    for descriptor, status, reason in streams:
        with os.fdopen(descriptor, "w") as stream, monkeypatch.context() as patched:
            patched.setattr(sys, "stdout", stream)
            assert command(*MISSING, "--progress", "json") == status
        assert capsys.readouterr().err == f"Standard output cannot be written: {reason}.\n"


def test_control_characters_of_a_path_are_spelt_out(capsys, monkeypatch) -> None:
    """And letters that the terminal's encoding lacks."""
    for path, spelt in (("a\nb.toml", r"a\nb.toml"), ("\x1b]0;owned\x07\x9b31m.toml", r"\x1b]0;owned\x07\x9b31m.toml")):
        assert refused(capsys, "inspect", path) == f"{spelt}: cannot be read: No such file or directory"
    assert printable_lines("two\nlines, räuchern, 烟") == "two\nlines, räuchern, 烟"
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stderr", io.TextIOWrapper(written, "ascii", write_through=True))
    assert command("inspect", "räuchern.toml") == 2
    assert written.getvalue() == b"r\\xe4uchern.toml: cannot be read: No such file or directory\n"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to send")
@pytest.mark.parametrize("number", ["SIGTERM", "SIGINT"])
def test_a_signal_while_the_engine_is_loaded_cancels(number) -> None:
    code = f"""
import os, signal, sys
import smokelift_command

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "smokelift.density":
            os.kill(os.getpid(), signal.{number})

signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Finder())
sys.exit(smokelift_command.main())
"""
    assert ended_python(code) == (130, b"Cancelled.\n")


def test_the_end_of_its_input_cancels() -> None:
    code = """
import sys, time
import smokelift_command
from smokelift_command import tethered

def work():
    print("working", flush=True)
    while True:
        time.sleep(0.01)

smokelift_command.main = work
sys.exit(tethered.main())
"""
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], env=ENVIRONMENT, **pipes) as process:
        assert process.stdout.readline().split() == [b"working"]
        assert process.communicate(timeout=60)[1].split() == [b"Cancelled."]
        assert process.returncode == 130


def test_an_import_changes_nothing_of_the_process() -> None:
    """A program that imports the engine keeps its own hook and handlers, in `python -m` of its own too."""
    code = """
import os, signal, sys
sys.argv = ["-m"]
handlers, environment = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)], dict(os.environ)
import smokelift
assert sys.excepthook is sys.__excepthook__
assert handlers == [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
assert environment == dict(os.environ)
"""
    assert ended_python(code) == (0, b"")


def of_system(number: int, path: str | None = None) -> OSError:
    """The system's error of a number, of a file or of none."""
    return OSError(number, os.strerror(number), *([path] if path else []))


def unwritten(reason: OSError | None) -> SequenceError:
    """The error of a sequence that could not be written, for a reason."""
    error = SequenceError("It could not be written.")
    error.__cause__ = reason
    return error


LIMITS = "gives no more memory or threads"


@pytest.mark.parametrize(
    ("error", "status", "said", "later"),
    [
        (of_system(errno.EAGAIN), 3, LIMITS, True),
        (of_system(errno.ENOMEM), 3, LIMITS, True),
        (RuntimeError("can't start new thread"), 3, LIMITS, True),
        (DeviceError("No GPU was found."), 3, "No GPU", False),
        (unwritten(of_system(errno.ENOSPC)), 2, "It could not be written.", True),
        (unwritten(of_system(errno.EACCES)), 2, "It could not be written.", False),
        (unwritten(None), 2, "It could not be written.", False),
        (of_system(errno.ENOSPC, "page.png"), 2, "page.png: cannot be written: the disk is full", True),
        (of_system(errno.EACCES, "page.png"), 2, "page.png: Permission denied", False),
    ],
)
def test_a_failure_has_its_status_its_sentence_and_whether_it_may_pass(
    shot, capsys, monkeypatch, error, status, said, later
) -> None:
    def fail(_choice: str) -> None:
        raise error

    monkeypatch.setattr(device, "start", fail)
    assert command("inspect", shot, "--progress", "json") == status
    event = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (event["event"], event["status"], event["later"]) == ("error", status, later)
    assert said in event["text"]
    assert said in refused(capsys, "inspect", shot, status=status)
