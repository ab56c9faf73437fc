"""Image and gradient of one iteration: Smokelift and every peer at every size and in every scene, one after another.

    python -m benchmarks.renderer [--sizes 32,64,128,256] [--peers smokelift,drjit,paper,mitsuba-1] [--device gpu]

Machines differ and are shared, so times are compared in pairs: Smokelift runs again between any two peers, and a peer's
ratio is its median over Smokelift's just before and just after. The floor is a copy of ten volumes. Memory is the peak
beyond imports, density and compiler, in MiB and in volumes of size^3 floats. Errors are relative L2 against float64.
Smokelift alone is timed by the fraction of voxels with smoke and by the number of lights.
"""

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import machine
from benchmarks.renderer import reference
from benchmarks.renderer.peers import OURS, PEERS
from benchmarks.renderer.scene import PLUME, bench_scene, plume
from benchmarks.renderer.worker import Result, run_apart
from benchmarks.tables import line, markdown, number
from smokelift.evaluation.metrics import volume_error
from smokelift.render.device import DeviceName

FULL = 1.0
"""Fraction of the voxels with smoke in the second scene; `PLUME` is that of the first."""

EXACT = 1e-3
"""Largest relative L2 error against float64 of an image or gradient that counts as exact."""

FRACTIONS = (0.05, 0.1, 0.18, 0.35, 0.6, 1.0)
"""Fractions of voxels with smoke at which Smokelift alone is timed."""

LIGHTS = (1, 16)
"""Numbers of directional lights with which Smokelift alone is timed."""

SWEEP_SIZE = 128
"""Voxels a side of the largest grid for the runs over fractions and lights."""

HEADER = (
    "peer", "ms", "times ours", "times the floor", "MiB", "volumes", "image error", "gradient error",
)  # fmt: skip

Array = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Row:
    """A peer at one size, in one scene. None stands for what was not measured.

    Attributes
    ----------
    peer
        Key in `PEERS`.
    result
        What was measured, or why nothing was.
    ratio
        The median time over Smokelift's just before and after.
    image_error, gradient_error
        Relative L2 error against the float64 reference; of the gradient, where there is smoke.
    """

    peer: str
    result: Result
    ratio: float | None = None
    image_error: float | None = None
    gradient_error: float | None = None

    def cells(self, size: int, floor: float) -> list[str]:
        """Return the cells of a table at a size, with the time (ms) of a copy of ten volumes."""
        name, result = PEERS[self.peer].title, self.result
        if result.failure:
            return [name, result.failure, *[""] * (len(HEADER) - 2)]
        peak = result.peak_bytes
        errors = (self.image_error, self.gradient_error)
        return [
            name,
            number(result.milliseconds),
            "1" if self.ratio is None else number(self.ratio),
            number(result.milliseconds / floor),
            number(None if peak is None else peak / 2**20),
            number(None if peak is None else peak / (4 * size**3)),
            *("?" if e is None else f"{e:.0e}" + ("" if e <= EXACT else " (not exact)") for e in errors),
        ]


class Stage:
    """One scene at one size with its exact answers, in a folder for the processes that run it.

    Parameters
    ----------
    folder
        It exists.
    size, fraction
        Voxels a side, and the fraction of them with smoke.
    device
        Where Smokelift runs; the peers run on the processor.
    """

    def __init__(self, folder: Path, size: int, fraction: float, device: DeviceName) -> None:
        self._folder, self._device = folder, device
        density = plume(size, fraction)
        turned = bench_scene(np.ascontiguousarray(density[::-1, ::-1]), np.zeros((size, size, 3), np.float32))
        self._scene = bench_scene(density, reference.image(turned).astype(np.float32))
        self._answers: dict[bool, tuple[Array, Array]] = {}
        np.save(folder / "density.npy", density)
        np.save(folder / "target.npy", self._scene.target)

    def compare(self, peers: Sequence[str]) -> list[Row]:
        """Return Smokelift's row, with all its iterations, and that of every peer between two runs of Smokelift."""
        ours = [self.row(OURS)]
        others = []
        for key in peers:
            row = self.row(key)
            if not row.result.failure:
                ours.append(self.row(OURS))
                around = [*ours[-2].result.seconds, *ours[-1].result.seconds]
                row = replace(row, ratio=row.result.milliseconds / (1e3 * float(np.median(around))))
            others.append(row)
        seconds = tuple(time for row in ours for time in row.result.seconds)
        return [replace(ours[0], result=replace(ours[0].result, seconds=seconds)), *others]

    def row(self, peer: str) -> Row:
        """Run a peer in a process of its own and score its image and gradient."""
        row = Row(peer, self.run(peer))
        if row.result.failure:
            return row
        image, gradient = self._answer(PEERS[peer].before_black)
        smoke = self._scene.density > 0
        of_image = volume_error(np.load(self._folder / "image.npy"), image)
        of_gradient = volume_error(np.load(self._folder / "gradient.npy")[smoke], gradient[smoke])
        return replace(row, image_error=of_image, gradient_error=of_gradient)

    def run(self, peer: str, lights: int = 1) -> Result:
        """Run a peer in a process of its own."""
        needs = PEERS[peer].needs
        return Result(failure=needs) if needs else run_apart(peer, self._folder, lights, self._device)

    def _answer(self, before_black: bool) -> tuple[Array, Array]:
        if before_black not in self._answers:
            scene = replace(self._scene, background=(0.0, 0.0, 0.0)) if before_black else self._scene
            self._answers[before_black] = reference.image_and_gradient(scene)
        return self._answers[before_black]


def main() -> None:
    """Print a table for each size and scene, and the times of Smokelift alone."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.renderer")
    parser.add_argument("--sizes", default="32,64,128,256", help="voxels per side")
    parser.add_argument("--peers", default=",".join(PEERS), help=f"of {', '.join(PEERS)}")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu", help="for Smokelift")
    options = parser.parse_args()
    sizes = sorted(map(int, options.sizes.split(",")))
    peers = [peer for peer in options.peers.split(",") if peer != OURS]
    print(machine.provenance("numpy", "taichi", "drjit", "mitsuba"))
    for size in sizes:
        floor = machine.copy_milliseconds(size)
        for fraction in (PLUME, FULL):
            print(f"\n{size}^3, smoke in {100 * fraction:.0f} %; the floor is {floor:.3g} ms\n")
            print(markdown(HEADER), flush=True)
            with tempfile.TemporaryDirectory() as folder:
                for row in Stage(Path(folder), size, fraction, options.device).compare(peers):
                    print(line(row.cells(size, floor)), flush=True)
    size = min(max(sizes), SWEEP_SIZE)
    print(f"\nSmokelift alone at {size}^3, ms\n\n{markdown(('smoke in', *map('{} lights'.format, LIGHTS)))}")
    for fraction in FRACTIONS:
        with tempfile.TemporaryDirectory() as folder:
            stage = Stage(Path(folder), size, fraction, options.device)
            times = [stage.run(OURS, lights) for lights in (LIGHTS if fraction == PLUME else LIGHTS[:1])]
            cells = [time.failure or number(time.milliseconds) for time in times]
            print(line([f"{100 * fraction:.0f} %", *cells, *[""] * (len(LIGHTS) - len(cells))]), flush=True)


if __name__ == "__main__":
    main()
