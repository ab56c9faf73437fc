"""What every test needs."""

import os

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""As the command ``smokelift`` starts, before NumPy is loaded: OpenBLAS's threads wait actively for one another."""


@pytest.fixture(scope="session", autouse=True)
def threads_of_a_worker() -> int:
    """Threads of a call of the compiled core; 0 is one per core. Workers side by side would wait for each other's."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        return 0
    from smokelift import _core

    _core.set_threads(1)
    return 1
