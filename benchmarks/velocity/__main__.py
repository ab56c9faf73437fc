"""Whole velocity estimates against known motion: error against time, by solver and iterations.

    python -m benchmarks.velocity [SCENES/plume-1/truth.npz ...] [--sizes 64x64x96,128x128x192]

Measured on baked scenes at their own sizes, and at other sizes on the built-in flow. Errors are of the motion of a
frame, relative L2 in the smoke and two voxels around it, without the inlet; estimates have no prediction and do not
know the inlet. Machines differ and are shared, so times are given in Poisson solves of the same grid, timed just before
and just after all that is measured.
"""

import argparse
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import machine
from benchmarks.tables import line, markdown, number, size_text, sizes_of
from benchmarks.velocity.flow import built_in_pair
from benchmarks.velocity.pairs import Pair, pair_of_truth
from smokelift.baselines.paper_method import PaperVelocity
from smokelift.evaluation.metrics import volume_error
from smokelift.evaluation.truth import Truth
from smokelift.velocity import CoarseToFine, DensityPair, PrimalDual, ProjectedCG, VelocityEstimator, VelocitySettings

ESTIMATORS: Mapping[str, VelocityEstimator] = {
    **{f"{n} iterations": CoarseToFine(VelocitySettings(solver=ProjectedCG(iterations=n))) for n in (2, 3, 5, 10, 20)},
    **{
        f"{n} primal-dual steps": CoarseToFine(VelocitySettings(solver=PrimalDual(iterations=n)))
        for n in (2, 5, 20, 100)
    },
    "1 linearization": CoarseToFine(replace(VelocitySettings(), linearizations=1)),
    "3 linearizations": CoarseToFine(replace(VelocitySettings(), linearizations=3)),
    "the paper's method": PaperVelocity(),
}

SHORT = ("2 iterations", "5 iterations", "10 iterations", "2 primal-dual steps", "1 linearization")
"""Estimators on large grids, where all would take hours."""

MANY_VOXELS = 1 << 20
"""Most voxels of a grid on which all estimators are measured, each on three pairs."""


def against_truth(pairs: Sequence[Pair], estimator: VelocityEstimator) -> tuple[float, float, float]:
    """Return the mean error over pairs, and the medians of seconds and solves."""
    found = []
    for pair in pairs:
        nx, ny, nz = pair.before.shape
        before = machine.poisson_seconds((nx, ny, nz))
        began = time.perf_counter()
        velocity = estimator.estimate(DensityPair(pair.before, pair.after, 1.0, 1.0))
        seconds = time.perf_counter() - began
        solves = 2 * seconds / (before + machine.poisson_seconds((nx, ny, nz)))
        found.append((volume_error(velocity.centres(), pair.motion, pair.compared), seconds, solves))
    errors, times, counts = zip(*found, strict=True)
    return float(np.mean(errors)), float(np.median(times)), float(np.median(counts))


def measure(name: str, shape: tuple[int, int, int], truth: Truth | None) -> None:
    """Print the table of a baked scene, or of the built-in flow at a size."""
    many = math.prod(shape) > MANY_VOXELS
    count = 1 if many else 3
    if truth is None:
        pairs = [built_in_pair(shape, seed) for seed in range(count)]
    else:
        frames = [round((truth.frames - 1) * (k + 1) / (count + 1)) for k in range(count)]
        pairs = [pair_of_truth(truth, frame) for frame in frames]
    motion = float(np.mean([np.linalg.norm(pair.motion[pair.compared], axis=-1).mean() for pair in pairs]))
    print(f"\n{name}, {size_text(shape)}: {motion:.2g} voxels per frame on average\n")
    print(markdown(("estimate (* by default)", "error", "solves", "ms")), flush=True)
    for words, estimator in ESTIMATORS.items():
        if words in SHORT or not many:
            error, seconds, solves = against_truth(pairs, estimator)
            usual = " *" if estimator == CoarseToFine() else ""
            print(line([words + usual, f"{error:.3f}", number(solves), number(1e3 * seconds)]), flush=True)


def main() -> None:
    """Measure everything that the command line names, or the built-in flow at the paper's sizes."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.velocity")
    parser.add_argument("truths", nargs="*", type=Path, metavar="TRUTH.npz", help="baked scenes")
    parser.add_argument("--sizes", type=sizes_of, help="voxels of the built-in flow")
    options = parser.parse_args()
    print(machine.provenance("numpy", "scipy"))
    for path in options.truths:
        truth = Truth.load(path)
        measure(path.parent.name, truth.shape, truth)
    for shape in options.sizes or (() if options.truths else machine.SHAPES):
        measure("built-in", shape, None)


if __name__ == "__main__":
    main()
