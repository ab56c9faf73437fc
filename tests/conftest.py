"""What every test needs."""

import os
import shutil
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""As the command ``smokelift`` starts, before NumPy is loaded: OpenBLAS's threads wait actively for one another."""

MEMORY = Path("/dev/shm")
"""A file system in memory. What is written whole or not at all is forced to the disk, where that takes milliseconds."""

if (
    os.access(MEMORY, os.W_OK)
    and shutil.disk_usage(MEMORY).free > 2**30
    and not os.statvfs(MEMORY).f_flag & os.ST_NOEXEC
):
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))


def pytest_runtest_setup() -> None:
    """Let the compiled core compute on one thread, of which boxes of a few voxels ask no more.

    Threads of workers side by side would wait for each other's. It is set before each test, because a command that an
    earlier one ran, or a test of threads, has set the number for the process.
    """
    core = sys.modules.get("smokelift._core")
    if core is not None:
        core.set_threads(1)
