"""What a frame costs by resolution and by the share of the voxels that may hold smoke, and where it stops.

    python -m benchmarks.pipeline.cost OUT.json --sizes 64x64x96,128x128x192 --extents 0.4,0.7,1

The built-in clip's smoke is made smaller in the same box. Time is the processor's, so that the figures are the same
beside other work, and is also given in Poisson solves of the same grid. A grid that does not fit is said to stop there.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from benchmarks import machine
from benchmarks.command import SHAPES, read_shapes
from benchmarks.pipeline.clip import with_grid, write_clip
from benchmarks.pipeline.worker import Job, Run, run_apart
from benchmarks.tables import markdown, number, size_text
from benchmarks.timing import UNTIMED
from smokelift.setup.settings import QUALITIES

Shape = tuple[int, int, int]

EXTENTS = (0.4, 0.7, 1.0)
"""Length of the smoke along each side of the box, in shares of the built-in clip's."""

MEMORY = 24.0
"""GiB of the largest machine that a grid is foretold for."""


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
    def of(runs: Sequence[Run], costs: Sequence[float]) -> Law:
        """Fit the law by least squares of the relative differences."""
        voxels = np.array([math.prod(run.size) for run in runs], np.float64)
        occupied = voxels * [run.occupied for run in runs]
        columns = np.stack([np.ones_like(voxels), voxels, occupied], -1)
        scale = columns.max(0)
        found, _ = nnls(columns / scale / np.array(costs)[:, None], np.ones(len(runs)))
        base, a_voxel, an_occupied = found / scale
        return Law(float(base), float(a_voxel), float(an_occupied))

    def most_voxels(self, limit: float, occupied: float) -> float:
        """Return how many voxels cost a limit, with a share of them occupied."""
        return (limit - self.base) / (self.a_voxel + occupied * self.an_occupied)


def exponents(runs: Sequence[Run], costs: Sequence[float]) -> tuple[float, float]:
    """Return the exponents a and b of voxels^a share^b, with the share of the voxels that may hold smoke.

    Parameters
    ----------
    runs
        At two sizes and two shares at least, all above 0.
    costs
        One a run, above 0.
    """
    voxels, occupied = (np.log(values) for values in zip(*((math.prod(r.size), r.occupied) for r in runs), strict=True))
    columns = np.stack([np.ones_like(voxels), voxels, occupied], -1)
    (_, a, b), *_ = np.linalg.lstsq(columns, np.log(costs), rcond=None)
    return float(a), float(b)


def measure(sizes: Sequence[Shape], extents: Sequence[float], job: dict[str, Any], out: Path) -> list[Run]:
    """Do a run of every size at every extent, one after the other, and save all after each."""
    runs: list[Run] = []
    for extent in extents:
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            known = write_clip(folder, UNTIMED + job["frames"], extent)
            for shape in sizes:
                with_grid(known, shape).save(folder / "scene.toml")
                found = run_apart(Job(scene=str(folder / "scene.toml"), size=shape, clock="processor", **job), folder)
                runs.append(found)
                print(f"{size_text(shape)}, extent {extent:g}: {found.failure or number(found.seconds) + ' s'}")
                results = {**machine.provenance(("numpy", "scipy")), **job, "runs": [asdict(run) for run in runs]}
                out.write_text(json.dumps(results, indent=1) + "\n")
    return runs


def text(runs: Sequence[Run], limit: float) -> str:
    """Return the table, the slopes, and the largest grid that a limit of memory (GiB) holds."""
    header = ("voxels", "may hold smoke", "s a frame", "solves", "MiB", "bytes a voxel")
    rows = [
        (size_text(run.size), *_cells(run)) if not run.failure else (size_text(run.size), run.failure, "", "", "", "")
        for run in runs
    ]
    done = [run for run in runs if not run.failure and run.memory_mib is not None]
    if len({run.size for run in done}) < 2:
        return markdown(header, rows)
    seconds, mib = [run.seconds for run in done], [run.memory_mib or 0.0 for run in done]
    memory, time = Law.of(done, mib), Law.of(done, seconds)
    bytes_a_voxel, bytes_more = (2**20 * cost for cost in (memory.a_voxel, memory.an_occupied))
    nanoseconds, more = (1e9 * cost for cost in (time.a_voxel, time.an_occupied))
    lines = [
        f"Memory: {memory.base:.0f} MiB, {bytes_a_voxel:.0f} bytes a voxel, {bytes_more:.0f} more where smoke may be.",
        f"Time: {time.base:.2f} s, {nanoseconds:.0f} ns a voxel, {more:.0f} more where smoke may be.",
    ]
    of_voxels, of_share = exponents(done, seconds)
    lines.append(f"Time grows as voxels^{of_voxels:.2f} share^{of_share:.2f}.")
    shares = [run.occupied for run in done]
    for occupied in (min(shares), max(shares)):
        most = memory.most_voxels(1024 * limit, occupied)
        lines.append(
            f"{limit:g} GiB hold {most / 1e6:.0f} million voxels of which {100 * occupied:.0f} % may hold smoke."
        )
    return "\n".join([markdown(header, rows), "", *lines])


def _cells(run: Run) -> tuple[str, ...]:
    memory = run.memory_mib
    a_voxel = None if memory is None else memory * 2**20 / math.prod(run.size)
    return f"{100 * run.occupied:.0f} %", number(run.seconds), f"{run.solves:.0f}", number(memory), number(a_voxel)


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pipeline.cost")
    parser.add_argument("out", type=Path)
    parser.add_argument("--sizes", type=read_shapes, default=SHAPES)
    parser.add_argument("--extents", type=lambda words: tuple(map(float, words.split(","))), default=EXTENTS)
    parser.add_argument("--quality", choices=QUALITIES, default="balanced")
    parser.add_argument("--detail", type=float, default=1.0)
    parser.add_argument("--frames", type=int, default=2)
    parser.add_argument("--memory", type=float, default=MEMORY, help="GiB that a grid is foretold for")
    options = parser.parse_args()
    job = {name: getattr(options, name) for name in ("quality", "detail", "frames")}
    runs = measure(options.sizes, options.extents, {"method": "default", **job}, options.out)
    print(text(runs, options.memory))


if __name__ == "__main__":
    main()
