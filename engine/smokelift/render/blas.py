"""Products of matrices on one thread.

OpenBLAS, which comes with NumPy and SciPy, has threads that wait actively for milliseconds after every product. They
keep the cores from the engine's own threads: a frame of 64 x 64 x 96 voxels takes 1.6 times as long beside them on two
cores (docs/experiments/memory-and-time.md). The command ``smokelift`` starts without them.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any

import scipy.linalg  # noqa: F401  its OpenBLAS is another than NumPy's, and is limited only if it is loaded
from threadpoolctl import ThreadpoolController


def products_on_one_thread() -> AbstractContextManager[Any]:
    """Within this context products take one thread, and after it as many as before."""
    limit: AbstractContextManager[Any] = _libraries().limit(limits=1, user_api="blas")
    return limit


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    """Return the libraries that are loaded; to find them takes as long as a picture."""
    return ThreadpoolController()
