"""The command ``smokelift`` that ends with whoever started it: when its standard input closes, on every system.

A program that holds the other end of the pipe cancels the run by closing it, and a program that is killed lets it go.
"""

import _thread
import os
import signal
import sys
import threading
import time
from contextlib import suppress

import smokelift_command
from smokelift_command.exits import CANCELLED

GRACE_SECONDS = 8.0
"""Time to end in order. Files appear whole or not at all, so an end at once does no harm after that."""

POLL_SECONDS = 0.1
"""Between two looks at standard input, where none can wait for its end."""


def main() -> int:
    """Run the command as `smokelift_command.main`, and cancel it when standard input closes."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background process may have been given none
    try:
        threading.Thread(target=_end_with_input, daemon=True).start()
        return smokelift_command.main()
    except KeyboardInterrupt:  # before or after the command handles it
        print("Cancelled.", file=sys.stderr)
        return CANCELLED


def _end_with_input() -> None:
    _wait_for_end_of_input()
    _thread.interrupt_main()
    time.sleep(GRACE_SECONDS)
    os._exit(CANCELLED)


def _wait_for_end_of_input() -> None:
    if sys.platform == "win32":
        # A read that waits there has all others who ask for the pipe's state wait too, and NumPy does as it is loaded:
        # https://github.com/numpy/numpy/issues/24290
        import _winapi
        import msvcrt

        pipe = msvcrt.get_osfhandle(0)
        with suppress(OSError):  # the other end is closed
            while True:
                _winapi.PeekNamedPipe(pipe, 0)
                time.sleep(POLL_SECONDS)
    else:
        while os.read(0, 4096):  # a buffered reader would hold its lock at the interpreter's end
            pass


if __name__ == "__main__":
    sys.exit(main())
