"""The command line ``smokelift``: its parser and its exit status. `smokelift_command` has its signals.

Exit status: 0 done, 2 bad input, 3 device or memory, 130 cancelled (and resumable).
"""

import argparse
import errno
import io
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from smokelift._core import set_threads
from smokelift.app.commands import batch, clips, directed, doctor, sequences
from smokelift.app.options import add_device, add_sequence, whole_number
from smokelift.app.progress import JsonReporter, OutputError, Reporter
from smokelift.checks import printable
from smokelift.footage.image_files import READABLE
from smokelift.output.index import DISK_FULL, DirectoryBusyError
from smokelift.output.vdb import PROXY_TIMES, VdbUnavailable
from smokelift.render import DeviceError
from smokelift_command.exits import BAD_INPUT, CANCELLED, DONE, NO_DEVICE, Termination

_TRANSIENT = {
    getattr(errno, name)
    for name in ("ENOSPC", "EDQUOT", "EIO", "ESTALE", "ETIMEDOUT", "EHOSTDOWN", "EHOSTUNREACH", "ENOTCONN")
    if hasattr(errno, name)  # some systems lack some
}
"""Errors of a storage that pass: it is full, or its server is away."""

MAX_THREADS = 1024
"""Largest number of threads: more than any processor has."""

COMMANDS: Mapping[str, tuple[Callable[..., None], Callable[..., None], str]] = {
    "reconstruct": (clips.reconstruct, clips.add_reconstruct_options, "turn a clip or scene file into a VDB sequence"),
    "extract": (
        clips.extract,
        clips.add_extract_options,
        "separate smoke from what is behind it, as pictures with alpha",
    ),
    "batch": (batch.run, batch.add_options, "reconstruct a list of shots, as many at a time as memory allows"),
    "inspect": (
        clips.inspect,
        clips.add_inspect_options,
        "say what a run would assume, choose and cost, without running it",
    ),
    "render": (sequences.render, sequences.add_render_options, "make an image or video of a sequence"),
    "check": (sequences.check, add_sequence, "check that a sequence is complete and undamaged"),
    "preview": (
        sequences.preview,
        sequences.add_preview_options,
        "make pictures and a video that show the smoke from all sides",
    ),
    "proxy": (sequences.proxy, add_sequence, f"write copies for viewports, with voxels {PROXY_TIMES} times as large"),
    "evaluate": (
        sequences.compare,
        sequences.add_evaluate_options,
        "compare the smoke with its front, known volumes and other cameras",
    ),
    "continue": (
        directed.continue_,
        directed.add_continue_options,
        "make what the smoke does after its clip, or in wind",
    ),
    "retime": (directed.retime, directed.add_retime_options, "make slow motion, fast motion and ramps of a sequence"),
    "loop": (directed.loop, directed.add_loop_options, "make a part of a sequence repeat without a seam"),
    "export": (sequences.export, sequences.add_export_options, "write small OpenVDB files, a proxy and a USD file"),
    "doctor": (doctor.run, lambda _parser: None, "list versions, devices and what is missing"),
}
"""What runs a command and says what happens, what adds its options, and what it is for, by its name."""

_HINT = " Finished frames stay; --resume goes on from them."


class _Parser(argparse.ArgumentParser):
    """Says what is wrong with a word, its control characters spelt out; takes -5:3 and -30,10 for values."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        # by default whole words that are numbers; there is no way to say it from outside
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message: str) -> NoReturn:
        super().error(printable(message))

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse, and refuse words that are left over, as many pictures are where a shell expands ``frame_*.png``."""
        options, rest = self.parse_known_args(args, namespace)
        if rest and all(Path(word).suffix.lower() in READABLE for word in rest):
            self.error(
                f"{len(rest) + 1} pictures are named, but one clip is expected; give its pictures as one pattern, "
                "frame_####.png"
            )
        if rest:
            self.error(f"unrecognized arguments: {' '.join(rest)}")
        return options


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # the terminal's encoding may lack a letter
            stream.reconfigure(errors="backslashreplace")
    hint = ""
    try:
        try:
            options = command_parser().parse_args(arguments)
            hint = _HINT if hasattr(options, "resume") else ""
            return _run(options, hint)
        finally:
            try:
                sys.stdout.flush()
            except OSError as error:
                raise OutputError(error) from error
    except OutputError as error:
        # the rest of the buffer would fail again when the interpreter ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"{error}{hint}", file=sys.stderr)
        return CANCELLED if error.closed else BAD_INPUT


def _run(options: argparse.Namespace, hint: str) -> int:
    say = JsonReporter() if options.progress == "json" else Reporter()
    set_threads(options.threads)
    try:
        try:
            with say:
                options.run(options, say)
        except Exception as error:
            if Termination.came:  # a library made another error of the interrupt
                raise KeyboardInterrupt from error
            raise
    except KeyboardInterrupt:
        say.fail(f"Cancelled.{hint}", CANCELLED)
        return CANCELLED
    except OutputError:
        raise
    except (DeviceError, MemoryError) as error:
        out_of_memory = isinstance(error, MemoryError)
        say.fail(str(error) or "Out of memory; choose a lower resolution.", NO_DEVICE, retryable=out_of_memory)
        return NO_DEVICE
    except (ValueError, VdbUnavailable, OSError, RuntimeError) as error:
        # the system's limits: ulimit -v, ulimit -u
        if getattr(error, "errno", None) in (errno.EAGAIN, errno.ENOMEM) or "start new thread" in str(error):
            say.fail(
                f"The system gives no more memory or threads ({error}); end other programs.", NO_DEVICE, retryable=True
            )
            return NO_DEVICE
        if isinstance(error, RuntimeError) and not isinstance(error, VdbUnavailable):
            raise
        say.fail(_sentence(error), BAD_INPUT, retryable=_is_transient(error))
        return BAD_INPUT
    return DONE


def _sentence(error: Exception) -> str:
    """What an error says, without the system's number."""
    if not isinstance(error, OSError) or error.filename is None or not error.strerror:
        return str(error)
    reason = "cannot be written: the disk is full" if error.errno in DISK_FULL else error.strerror
    return f"{error.filename}: {reason}"


def _is_transient(error: BaseException | None) -> bool:
    """Return whether a failure passes by itself: the storage's, or another run in the same directory."""
    while error is not None:
        if isinstance(error, DirectoryBusyError) or getattr(error, "errno", None) in _TRANSIENT:
            return True
        error = error.__cause__
    return False


def command_parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="smokelift", description="Turn a video of smoke into an OpenVDB sequence of density and velocity."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    common = _Parser(add_help=False)
    add_device(common)
    common.add_argument(
        "--progress",
        choices=("text", "json"),
        default="text",
        help="text (default): a bar; json: an object per line",
    )
    common.add_argument(
        "--threads", type=whole_number(0, MAX_THREADS), default=0, metavar="N", help="threads at most; 0 (default): all"
    )
    for name, (run, add_options, help_text) in COMMANDS.items():
        of_command = commands.add_parser(name, parents=[common], help=help_text)
        add_options(of_command)
        of_command.set_defaults(run=run)
    return parser


if __name__ == "__main__":
    sys.exit(main())
