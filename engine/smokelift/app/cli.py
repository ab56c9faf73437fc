"""The command line ``smokelift``: its parser, its signals and its exit status.

Exit status: 0 done, 2 bad input, 3 device or memory, 130 cancelled (and resumable).
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from types import FrameType

from smokelift.app.commands import COMMANDS
from smokelift.app.progress import reporter
from smokelift.output.vdb import VdbUnavailable
from smokelift.render import DeviceError

DONE, BAD_INPUT, NO_DEVICE, CANCELLED = 0, 2, 3, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status."""
    options = _parser().parse_args(arguments)
    say = reporter(getattr(options, "progress", "text"))
    terminated = False

    def terminate(_number: int, _frame: FrameType | None) -> None:
        nonlocal terminated
        terminated = True
        raise KeyboardInterrupt

    # Ctrl-C on a terminal and SIGTERM from a parent mean the same.
    signal.signal(signal.SIGTERM, terminate)
    try:
        try:
            with say:
                options.run(options, say)
        except Exception as error:
            if terminated:  # a library turned the interrupt into an error of its own
                raise KeyboardInterrupt from error
            raise
    except KeyboardInterrupt:
        hint = "; finished frames stay, --resume goes on from them" if options.command == "reconstruct" else ""
        say.fail(f"Cancelled{hint}.", CANCELLED)
        return CANCELLED
    except (DeviceError, MemoryError) as error:
        say.fail(str(error) or "Out of memory; choose a lower --resolution.", NO_DEVICE)
        return NO_DEVICE
    except (ValueError, VdbUnavailable, OSError) as error:
        say.fail(str(error), BAD_INPUT)
        return BAD_INPUT
    return DONE


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="smokelift", description="Turn a video of smoke into an OpenVDB sequence of density and velocity."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--device", choices=("auto", "cpu", "gpu"), default="auto", help="where to render")
    common.add_argument("--progress", choices=("text", "json"), default="text", help="a bar, or one JSON object a line")
    for add_parser in COMMANDS:
        add_parser(commands, common)
    return parser


if __name__ == "__main__":
    sys.exit(main())
