"""The command ``smokelift`` that ends with whoever started it: when its standard input closes, on every system.

A program that holds the other end of the pipe cancels the run by closing it, and a program that is killed lets it go.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time

import smokelift_command

GRACE_SECONDS = 8.0
"""Time to end in order. Files appear whole or not at all, so an end at once does no harm after that."""


def main() -> int:
    """Run the command as `smokelift_command.main`, and cancel it when standard input closes."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background process may have been given none
    try:
        threading.Thread(target=_end_with_input, daemon=True).start()
        return smokelift_command.main()
    except KeyboardInterrupt:  # before or after the command handles it
        print("Cancelled.", file=sys.stderr)
        return smokelift_command.CANCELLED


def _end_with_input() -> None:
    while os.read(0, 4096):  # a buffered reader would hold its lock at the interpreter's end
        pass
    _thread.interrupt_main()
    time.sleep(GRACE_SECONDS)
    os._exit(smokelift_command.CANCELLED)


if __name__ == "__main__":
    sys.exit(main())
