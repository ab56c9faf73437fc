"""What bounds an iteration of the renderer: each compiled step beside a copy of memory, at sizes in and out of caches.

    python -m benchmarks.renderer.roofline --sizes 64,256

One thread and its processor time, with smoke everywhere; copies alternate with the iterations, so that both meet the
same machine. Bytes are those that a step has to move if every line of memory is read and written once; the layout has
extinction and one channel of light side by side. A step whose time a voxel is the same where all of it fits into
caches is bound by its instructions, however many bytes it moves.
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

import smokelift._core as _core
from benchmarks.renderer.peers import ours
from benchmarks.renderer.scene import bench_scene, plume
from benchmarks.tables import markdown, number

BYTES = {"pack": 21, "shade": 16, "march": 16, "march_adjoint": 48, "shade_adjoint": 40, "unpack": 13}
"""Bytes a voxel of each step. march_adjoint clears (8), turns samples into derivatives (16) and adds them up (24);
shade_adjoint multiplies (20) and sweeps back (20)."""

COPIED = 80
"""Bytes a voxel that a copy of ten volumes reads and writes."""

ITERATIONS = 9
UNTIMED = 2


class Clocked:
    """The compiled module, with the processor time of its functions."""

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)

    def __getattr__(self, name: str) -> Any:
        """Return a class as it is, and a function with a clock."""
        found = getattr(_core, name)
        return found if isinstance(found, type) else self._clocked(name, found)

    def _clocked(self, name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        def clocked(*arguments: Any) -> Any:
            began = time.process_time()
            result = work(*arguments)
            self.seconds[name].append(time.process_time() - began)
            return result

        return clocked


def measure(size: int) -> tuple[dict[str, float], float]:
    """Return the nanoseconds a voxel of every step and of a copy of ten volumes, medians."""
    clocked = Clocked()
    backend = import_module("smokelift.render.cpu_backend")
    backend._core = clocked  # type: ignore[attr-defined]  # only here are the steps told apart
    scene = bench_scene(plume(size, 1.0), np.full((size, size, 3), 0.3, np.float32))
    iteration = ours.prepare(scene)
    source = np.ones(10 * size**3, np.float32)
    target, copies = np.zeros_like(source), []
    for _ in range(ITERATIONS):
        iteration.run(scene.density)
        began = time.process_time()
        np.copyto(target, source)
        copies.append(time.process_time() - began)

    def a_voxel(seconds: list[float]) -> float:
        return 1e9 * float(np.median(seconds[UNTIMED:])) / size**3

    return {name: a_voxel(clocked.seconds[name]) for name in BYTES}, a_voxel(copies)


def text(found: dict[int, tuple[dict[str, float], float]]) -> str:
    """Return a row a step: nanoseconds a voxel at each size, then how it stands to memory at the largest."""
    largest = max(found)
    steps, copy = found[largest]
    header = ["step", *(f"ns a voxel, {size}^3" for size in found), "bytes a voxel", "GB/s", "of a copy's", "copies"]
    rows = []
    for name in [*BYTES, "all"]:
        spent = [sum(times.values()) if name == "all" else times[name] for times, _ in found.values()]
        last = sum(steps.values()) if name == "all" else steps[name]
        moved = sum(BYTES.values()) if name == "all" else BYTES[name]
        share = f"{100 * (moved / last) / (COPIED / copy):.0f} %"
        rows.append([name, *map(number, spent), str(moved), number(moved / last), share, number(last / copy)])
    copies = [number(a_copy) for _, a_copy in found.values()]
    rows.append(["copy of ten volumes", *copies, str(COPIED), number(COPIED / copy), "100 %", "1"])
    return markdown(header, rows)


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.renderer.roofline")
    parser.add_argument("--sizes", type=lambda words: [int(word) for word in words.split(",")], default=[64, 256])
    options = parser.parse_args()
    _core.set_threads(1)
    print(text({size: measure(size) for size in sorted(options.sizes)}))


if __name__ == "__main__":
    main()
