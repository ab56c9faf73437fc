"""The machine that a benchmark runs on: what it is, and time in seconds and in Poisson solves of the same grid."""

import os
import platform
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import date
from importlib import metadata
from pathlib import Path
from typing import TypeVar

import numpy as np
import psutil
import scipy.fft

import smokelift
from smokelift.report.cost import peak_memory

COPY_THREADS = 2
"""Threads that copy memory: enough to fill the bus of a desktop processor."""

SHAPES = ((64, 64, 96), (128, 128, 192), (256, 256, 288))
"""The resolutions of the paper's table 2."""

UNTIMED = 2
"""Frames that do not count: the first two come together, and compilers work before them."""

POISSON_THREADS = 2
"""Threads of a Poisson solve: those of the machine that the published tables were measured on."""

Frame = TypeVar("Frame")


def provenance(*libraries: str) -> str:
    """Return two lines that say on what machine, when and with what of these libraries results are measured."""
    found = {"smokelift": smokelift.__version__}
    for name in libraries:
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    versions = ", ".join(f"{name} {version}" for name, version in found.items())
    return f"{processor()}, {date.today().isoformat()}\n{versions}"


def processor() -> str:
    """Return the processor's name and how many of its cores may be used."""
    cores = len(psutil.Process().cpu_affinity()) if hasattr(psutil.Process, "cpu_affinity") else os.cpu_count()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{(models or [platform.processor() or platform.machine()])[0]}, {cores} cores"


def copy_milliseconds(size: int) -> float:
    """Return the median time to copy ten volumes of size^3 floats, the lower bound of an iteration (ms)."""
    source = np.ones((COPY_THREADS, 10 * size**3 // COPY_THREADS), np.float32)
    target = np.zeros_like(source)
    spent = []
    with ThreadPoolExecutor(COPY_THREADS) as threads:
        for _ in range(9):
            began = time.perf_counter()
            list(threads.map(np.copyto, target, source))
            spent.append(time.perf_counter() - began)
    return 1e3 * float(np.median(spent[2:]))


def poisson_seconds(shape: tuple[int, int, int], clock: Callable[[], float] = time.perf_counter) -> float:
    """Return the time of a Poisson solve by cosine transforms in float32, the median of five (s).

    It is the unit of times that grow with the grid as a Poisson solve does. `clock` returns the time now (s).
    """
    field = np.random.default_rng(0).standard_normal(shape, np.float32)
    waves = [2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in shape]
    symbol = (waves[0][:, None, None] + waves[1][None, :, None] + waves[2]).astype(np.float32)
    symbol[0, 0, 0] = 1
    spent = []
    for _ in range(5):
        began = clock()
        scipy.fft.idctn(scipy.fft.dctn(field, workers=POISSON_THREADS) / symbol, workers=POISSON_THREADS)
        spent.append(clock() - began)
    return float(np.median(spent))


def peak_mib() -> float | None:
    """Return the peak of this process's memory in MiB; None where the system does not say."""
    peak = peak_memory()
    return None if peak is None else peak / 2**20


class FrameTimes:
    """Times of a run's frames. Between them a Poisson solve is timed, because the machine may be busy.

    Parameters
    ----------
    shape
        Voxels along x, y and z.
    clock
        Returns the time now (s): what a user waits, or `time.process_time`, which counts the work of all cores and is
        the same beside other work.
    """

    def __init__(self, shape: tuple[int, int, int], clock: Callable[[], float] = time.perf_counter) -> None:
        self._shape, self._clock = shape, clock
        self._seconds: list[float] = []
        self._units: list[float] = []

    def before(self, action: Callable[[Frame], object]) -> Callable[[Frame], None]:
        """Return what to call with each frame once it is made: it times the making from now on, but not the action."""
        began = self._clock()

        def timed(frame: Frame) -> None:
            nonlocal began
            self._seconds.append(self._clock() - began)
            self._units.append(poisson_seconds(self._shape, self._clock))
            action(frame)
            began = self._clock()

        return timed

    @property
    def seconds(self) -> float:
        """A frame (s), the median."""
        return median(self._seconds)

    @property
    def solves(self) -> float:
        """A frame in Poisson solves."""
        return self.seconds / median(self._units)


def median(values: list[float]) -> float:
    """Return the median over the frames that count; over all, if there are no others."""
    return float(np.median(values[UNTIMED:] or values))
