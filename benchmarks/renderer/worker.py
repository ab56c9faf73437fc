"""One peer, one scene, one process: clean thread pools and a peak of memory that is its own.

    python -m benchmarks.renderer.worker PEER FOLDER LIGHTS DEVICE

reads density.npy and target.npy from the folder and writes image.npy, gradient.npy and result.json there. What a
framework prints is not shown.
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import psutil

from benchmarks.process import run_module, why_it_ended
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
    """Run a peer in a process of its own, on the scene in a folder; its image and gradient are written there.

    The device is Smokelift's; the other peers choose their own.
    """
    result = folder / "result.json"
    result.unlink(missing_ok=True)
    ended = run_module("benchmarks.renderer.worker", peer, str(folder), str(lights), device)
    if result.exists():
        found = json.loads(result.read_text())
        return Result(**{**found, "seconds": tuple(found["seconds"])})
    return Result(failure=why_it_ended(ended))


def measure(peer: str, scene: BenchScene) -> tuple[Result, Any, Any]:
    """Run a peer in this process; returns its image and gradient too."""
    prepare = prepare_function(peer)
    small = bench_scene(plume(TINY, 0.5), np.zeros((TINY, TINY, 3), np.float32), len(scene.lights))
    tiny = prepare(small)
    tiny.run(tiny.upload(small.density))
    del tiny
    before = _reset_peak()
    iteration = prepare(scene)
    density = iteration.upload(scene.density)
    for _ in range(WARM_UPS):
        iteration.run(density)
    seconds, outcome = _clocked(iteration, density)
    peak = peak_memory()
    image, gradient = iteration.download(*outcome)
    result = Result(
        seconds=tuple(seconds),
        peak_bytes=None if peak is None or before is None else max(peak - before, 0),
    )
    return result, image, gradient


def prepare_function(peer: str) -> Callable[[BenchScene], Iteration]:
    """Import a peer, and return the function that prepares it for a scene."""
    described = PEERS[peer]
    module = importlib.import_module(f"benchmarks.renderer.peers.{described.module}")

    def prepare(scene: BenchScene) -> Iteration:
        if described.before_black:
            scene = replace(scene, background=(0.0, 0.0, 0.0))
        iteration: Iteration = module.prepare(scene, *described.arguments)
        return iteration

    return prepare


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


def main() -> None:
    """Run the peer that the command line names."""
    peer, folder, lights, device = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), cast(DeviceName, sys.argv[4])
    try:
        scene = bench_scene(np.load(folder / "density.npy"), np.load(folder / "target.npy"), lights)
        start(device)
        result, image, gradient = measure(peer, scene)
    except MemoryError:
        result = Result(failure="Out of memory.")
    except Exception as error:  # whatever a framework raises, the others go on
        lines = str(error).strip().splitlines() or [type(error).__name__]
        result = Result(failure=lines[-1])
    else:
        np.save(folder / "image.npy", image)
        np.save(folder / "gradient.npy", gradient)
    (folder / "result.json").write_text(json.dumps(asdict(result)))


if __name__ == "__main__":
    main()
