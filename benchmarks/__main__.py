"""``python -m benchmarks renderer | velocity | pipeline``: the same as ``smokelift bench``."""

import sys

from smokelift.app.cli import main

sys.exit(main(["bench", *sys.argv[1:]]))
