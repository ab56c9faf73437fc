"""What every test needs."""

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""As the command ``smokelift`` starts, before NumPy is loaded: OpenBLAS's threads wait actively for one another."""


def pytest_runtest_setup() -> None:
    """Let the compiled core compute on one thread, of which boxes of a few voxels ask no more.

    Threads of workers side by side would wait for each other's. It is set before each test, because a command that an
    earlier one ran, or a test of threads, has set the number for the process.
    """
    core = sys.modules.get("smokelift._core")
    if core is not None:
        core.set_threads(1)
