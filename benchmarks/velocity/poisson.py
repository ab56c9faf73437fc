"""The core's Poisson solve beside the same by SciPy's transforms, which are pocketfft's.

    python -m benchmarks.velocity.poisson

All sides are open: DST-II along three axes, in single precision. Both take turns; the fastest of each counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import scipy.fft

import smokelift._core as _core
from benchmarks.tables import markdown
from smokelift.transport import Array

GRIDS = ((60, 60, 90), (64, 64, 96), (67, 71, 101), (96, 96, 144), (128, 128, 192))
TURNS = 15


def by_scipy(values: Array, threads: int) -> Array:
    """Solve -laplace p = f on a grid (nx, ny, nz) whose sides are open."""
    squares = (2 - 2 * np.cos(np.pi * np.arange(1, count + 1, dtype=np.float32) / count) for count in values.shape)
    x, y, z = np.ix_(*squares)
    modes = scipy.fft.dstn(values, type=2, workers=threads) / (x + y + z)
    return np.asarray(scipy.fft.idstn(modes, type=2, workers=threads), np.float32)


def seconds(solve: Callable[[], Array]) -> float:
    """Return the time of one solve."""
    began = time.perf_counter()
    solve()
    return time.perf_counter() - began


def row(shape: tuple[int, int, int], threads: int) -> list[str]:
    """Return a row of the table."""
    values = np.random.default_rng(0).standard_normal(shape).astype(np.float32)
    _core.set_threads(threads)

    def by_core() -> Array:
        return _core.solve_poisson(values, (False,) * 6)

    def by_other() -> Array:
        return by_scipy(values, threads)

    times = [(seconds(by_core), seconds(by_other)) for _ in range(TURNS)]
    core, other = np.min(times, axis=0)
    ours, theirs = by_core(), by_other()
    difference = float(np.abs(ours - theirs).max() / np.abs(theirs).max())
    return [" x ".join(map(str, shape)), str(threads), f"{other / core:.1f}", f"{difference:.0e}"]


def main() -> None:
    """Print the table."""
    rows = [row(shape, threads) for shape in GRIDS for threads in (1, 2)]
    print(markdown(["grid", "threads", "SciPy's time over the core's", "largest difference"], rows))


if __name__ == "__main__":
    main()
