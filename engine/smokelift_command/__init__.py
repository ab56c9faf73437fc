"""The command ``smokelift``, apart from the engine: that takes a second to load, and a signal may come in that time."""

import os
import signal
import sys

from smokelift_command.exits import CANCELLED, Termination


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
