"""The machine that a benchmark runs on: what it is, how fast it copies memory and solves a Poisson equation."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import scipy.fft

import smokelift
from smokelift.report.cost import peak_memory

COPY_THREADS = 2
"""Threads that copy memory: enough to fill the bus of a desktop processor."""

POISSON_THREADS = 2
"""Threads of a Poisson solve: those of the machine that the published tables were measured on."""


def provenance(libraries: Iterable[str]) -> dict[str, Any]:
    """Return ``date``, ``machine`` and ``versions``, with which all results begin."""
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": describe(),
        "versions": versions(libraries),
    }


def describe() -> dict[str, Any]:
    """Return processor, cores that may be used, memory and systems."""
    return {
        "processor": _processor(),
        "cores": len(psutil.Process().cpu_affinity()) if hasattr(psutil.Process, "cpu_affinity") else os.cpu_count(),
        "memory_gib": round(psutil.virtual_memory().total / 2**30, 1),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": platform.python_version(),
    }


def versions(libraries: Iterable[str]) -> dict[str, str]:
    """Return our version and those of the libraries that are installed."""
    found = {"smokelift": smokelift.__version__}
    for name in libraries:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def provenance_text(results: dict[str, Any], where: str = "") -> str:
    """Return two lines that say on what machine, when and with what libraries results were measured."""
    computer = results["machine"]
    libraries = ", ".join(f"{name} {version}" for name, version in results["versions"].items())
    return f"{computer['processor']}, {computer['cores']} cores{where}, {results['date']}\n{libraries}"


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


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
