"""``python -m benchmarks renderer | velocity | pipeline``: speed and error, beside others on the same machine."""

import sys

from benchmarks.command import main

sys.exit(main())
