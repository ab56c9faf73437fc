"""The command ``smokelift``, apart from the engine: that takes a second to load, and a signal may come in that time."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

DONE, BAD_INPUT, NO_DEVICE, CANCELLED = 0, 2, 3, 130
"""Exit statuses; a run that was cancelled can be resumed."""


class Termination:
    """SIGTERM from a parent, which means the same as Ctrl-C on a terminal.

    Attributes
    ----------
    came
        Whether it did: a library may turn the interrupt into an error of its own.
    """

    came = False

    @classmethod
    def handle(cls, _number: int, _frame: FrameType | None) -> None:
        """Interrupt the program."""
        cls.came = True
        raise KeyboardInterrupt


def main() -> int:
    """Load the engine, run its command and return the exit status; see `smokelift.app.cli`."""
    signal.signal(signal.SIGTERM, Termination.handle)
    # NumPy's OpenBLAS hangs where the system gives it no threads, and the engine computes in its own
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from smokelift.app import cli

        return cli.main()
    except KeyboardInterrupt:
        pass
    except Exception:
        if not Termination.came:
            raise
    print("Cancelled.", file=sys.stderr)
    return CANCELLED
