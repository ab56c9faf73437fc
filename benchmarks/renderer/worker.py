"""One peer, one scene, one process: clean thread pools and a peak of memory that is its own."""

import importlib
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.process import apart
from benchmarks.renderer.peers import PEERS, Iteration
from benchmarks.renderer.scene import BenchScene, bench_scene, plume
from smokelift.render.device import DeviceName, start
from smokelift.report.cost import peak_memory

WARM_UPS = 2
"""Iterations before the timed ones."""

MIN_RUNS, MAX_RUNS = 5, 25
"""Numbers of timed iterations; between them, they end after `ENOUGH_SECONDS`."""

ENOUGH_SECONDS = 2.0
SLOW_SECONDS = 5.0
"""An iteration that takes longer is run only twice."""

TINY = 6
"""Voxels a side of the grid that runs first, so that compilers are done before memory is counted."""


@dataclass(frozen=True)
class Result:
    """Times and memory of a peer.

    Attributes
    ----------
    seconds
        Time of each iteration: image and gradient.
    peak_bytes
        Peak of memory beyond what is in use before the set-up: imports, compiler, density and target do not count.
        None where the system does not say.
    failure
        Why there is nothing else, one sentence; else empty.
    """

    seconds: tuple[float, ...] = ()
    peak_bytes: int | None = None
    failure: str = ""

    @property
    def milliseconds(self) -> float:
        """An iteration, the median."""
        return 1e3 * float(np.median(self.seconds))


def run_apart(peer: str, folder: Path, lights: int = 1, device: DeviceName = "cpu") -> Result:
    """Run a peer in a process of its own on density.npy and target.npy of a folder; leaves image.npy and gradient.npy.

    The device is Smokelift's; the other peers choose their own.
    """
    found = apart(_in_folder, peer, folder, lights, device)
    return Result(failure=found) if isinstance(found, str) else found


def _in_folder(peer: str, folder: Path, lights: int, device: DeviceName) -> Result:
    scene = bench_scene(np.load(folder / "density.npy"), np.load(folder / "target.npy"), lights)
    start(device)
    result, image, gradient = measure(peer, scene)
    np.save(folder / "image.npy", image)
    np.save(folder / "gradient.npy", gradient)
    return result


def measure(peer: str, scene: BenchScene) -> tuple[Result, Any, Any]:
    """Run a peer in this process; returns its image and gradient too."""
    small = bench_scene(plume(TINY, 0.5), np.zeros((TINY, TINY, 3), np.float32), len(scene.lights))
    tiny = prepared(peer, small)
    tiny.run(tiny.upload(small.density))
    del tiny
    before = _reset_peak()
    iteration = prepared(peer, scene)
    density = iteration.upload(scene.density)
    for _ in range(WARM_UPS):
        iteration.run(density)
    seconds, outcome = _clocked(iteration, density)
    peak = peak_memory()
    image, gradient = iteration.download(*outcome)
    used = None if peak is None or before is None else max(peak - before, 0)
    return Result(seconds=tuple(seconds), peak_bytes=used), image, gradient


def prepared(peer: str, scene: BenchScene) -> Iteration:
    """Import a peer and prepare it for a scene."""
    described = PEERS[peer]
    module = importlib.import_module(f"benchmarks.renderer.peers.{described.module}")
    if described.before_black:
        scene = replace(scene, background=(0.0, 0.0, 0.0))
    iteration: Iteration = module.prepare(scene, *described.arguments)
    return iteration


def _clocked(iteration: Iteration, density: Any) -> tuple[list[float], Any]:
    seconds: list[float] = []
    while len(seconds) < MIN_RUNS or (len(seconds) < MAX_RUNS and sum(seconds) < ENOUGH_SECONDS):
        began = time.perf_counter()
        outcome = iteration.run(density)
        seconds.append(time.perf_counter() - began)
        if len(seconds) == 2 and min(seconds) > SLOW_SECONDS:
            break
    return seconds, outcome


def _reset_peak() -> int | None:
    """Reset the peak of memory; returns the bytes in use now, or None where the system has no such count."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return None
    return int(psutil.Process().memory_info().rss)
