"""``smokelift batch`` with the fake engine, and little patience with one that does not end by itself."""

import functools
import signal
import sys
from pathlib import Path

import smokelift_command
from smokelift.app.commands import batch
from smokelift.batch import work

FAKE = (sys.executable, "-S", str(Path(__file__).with_name("fake_engine.py")))

if __name__ == "__main__":
    # a test run in the background may ignore SIGINT, which children inherit
    signal.signal(signal.SIGINT, signal.default_int_handler)
    batch.inspect_shot = functools.partial(work.inspect_shot, engine=FAKE)
    batch.finish_shot = functools.partial(work.finish_shot, engine=FAKE, grace=0.1)
    sys.exit(smokelift_command.main())
