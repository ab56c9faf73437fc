"""What a frame costs by resolution and by the fraction of the voxels that may hold smoke, and where it stops.

    python -m benchmarks.pipeline --frames 5
    python -m benchmarks.pipeline --clock processor --sizes 64x64x96,128x128x192 --extents 0.4,0.7,1

Whole runs of the built-in clip, from decoding it to OpenVDB files on disk, each in a process of its own. Its smoke is
made smaller in the same box. Machines differ and are shared, so times are also given in Poisson solves of the same
grid, timed between the frames; density and velocity are always in the seconds that pass. A grid that does not fit is
said to stop there.
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from benchmarks import machine
from benchmarks.machine import UNTIMED
from benchmarks.pipeline.clip import with_grid, write_clip
from benchmarks.pipeline.worker import CLOCKS, Run, run_apart
from benchmarks.tables import line, markdown, number, size_text, sizes_of
from smokelift.setup.settings import QUALITIES, Settings

MEMORY = 24.0
"""GiB of the largest machine that a grid is foretold for."""

HEADER = (
    "voxels", "may hold smoke", "density s", "velocity s", "s per frame", "solves", "MiB", "bytes per voxel",
    "front dB",
)  # fmt: skip


@dataclass(frozen=True)
class Law:
    """A cost as base + a box's voxel + an occupied voxel, each times its number; none of them negative.

    Attributes
    ----------
    base, a_voxel, an_occupied
        In units of what was measured.
    """

    base: float
    a_voxel: float
    an_occupied: float

    @staticmethod
    def of(runs: Sequence[Run], costs: Sequence[float]) -> "Law":
        """Fit the law by least squares of the relative differences."""
        voxels = np.array([math.prod(run.size) for run in runs], np.float64)
        occupied = voxels * [run.occupied for run in runs]
        columns = np.stack([np.ones_like(voxels), voxels, occupied], -1)
        scale = columns.max(0)
        found, _ = nnls(columns / scale / np.array(costs)[:, None], np.ones(len(runs)))
        base, a_voxel, an_occupied = found / scale
        return Law(float(base), float(a_voxel), float(an_occupied))

    def most_voxels(self, limit: float, occupied: float) -> float:
        """Return how many voxels cost a limit, with a fraction of them occupied."""
        return (limit - self.base) / (self.a_voxel + occupied * self.an_occupied)


def exponents(runs: Sequence[Run], costs: Sequence[float]) -> tuple[float, float]:
    """Return the exponents a and b of voxels^a fraction^b, with the fraction of the voxels that may hold smoke.

    Parameters
    ----------
    runs
        At two sizes and two fractions at least, all above 0.
    costs
        One a run, above 0.
    """
    voxels, occupied = (np.log(values) for values in zip(*((math.prod(r.size), r.occupied) for r in runs), strict=True))
    columns = np.stack([np.ones_like(voxels), voxels, occupied], -1)
    (_, a, b), *_ = np.linalg.lstsq(columns, np.log(costs), rcond=None)
    return float(a), float(b)


def laws(runs: Sequence[Run]) -> list[str]:
    """Return the laws that runs follow, and the largest grid that `MEMORY` holds; nothing for a single size."""
    done = [run for run in runs if not run.failure and run.memory_mib is not None]
    if len({run.size for run in done}) < 2:
        return []
    seconds, mib = [run.seconds for run in done], [run.memory_mib or 0.0 for run in done]
    memory, time = Law.of(done, mib), Law.of(done, seconds)
    per_voxel, bytes_more = (2**20 * cost for cost in (memory.a_voxel, memory.an_occupied))
    nanoseconds, more = (1e9 * cost for cost in (time.a_voxel, time.an_occupied))
    of_voxels, of_fraction = exponents(done, seconds)
    fractions = [run.occupied for run in done]
    return [
        f"Memory: {memory.base:.0f} MiB, {per_voxel:.0f} bytes per voxel, {bytes_more:.0f} more where smoke may be.",
        f"Time: {time.base:.2f} s, {nanoseconds:.0f} ns per voxel, {more:.0f} more where smoke may be.",
        f"Time grows as voxels^{of_voxels:.2f} fraction^{of_fraction:.2f}.",
        *(
            f"{MEMORY:g} GiB hold {memory.most_voxels(1024 * MEMORY, occupied) / 1e6:.0f} million voxels of which "
            f"{100 * occupied:.0f} % may hold smoke."
            for occupied in (min(fractions), max(fractions))
        ),
    ]


def _cells(run: Run) -> list[str]:
    if run.failure:
        return [size_text(run.size), run.failure, *[""] * (len(HEADER) - 2)]
    memory = run.memory_mib
    a_voxel = None if memory is None else memory * 2**20 / math.prod(run.size)
    times = [f"{seconds:.2f}" for seconds in (run.seconds_density, run.seconds_velocity, run.seconds)]
    cost = [f"{run.solves:.0f}", number(memory), number(a_voxel)]
    return [size_text(run.size), f"{100 * run.occupied:.0f} %", *times, *cost, f"{run.psnr:.1f}"]


def main() -> None:
    """Measure, and print each row."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pipeline")
    parser.add_argument("--sizes", type=sizes_of, default=machine.SHAPES)
    parser.add_argument("--extents", type=lambda words: tuple(map(float, words.split(","))), default=(1.0,))
    parser.add_argument("--quality", choices=QUALITIES, default="balanced")
    parser.add_argument("--detail", type=float, default=1.0)
    parser.add_argument("--frames", type=int, default=2, help="frames to time, after two that are not timed")
    parser.add_argument("--clock", choices=CLOCKS, default="wall", help="what a user waits, or the work of all cores")
    options = parser.parse_args()
    print(machine.provenance("numpy", "scipy"), markdown(HEADER), sep="\n\n", flush=True)
    runs, settings = [], replace(Settings.preset(options.quality), detail=options.detail)
    for extent in options.extents:
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            known = write_clip(folder, UNTIMED + options.frames, extent)
            for shape in options.sizes:
                with_grid(known, shape).save(folder / "scene.toml")
                runs.append(run_apart(folder / "scene.toml", settings, shape, options.frames, options.clock))
                print(line(_cells(runs[-1])), flush=True)
    print("", *laws(runs), sep="\n")


if __name__ == "__main__":
    main()
