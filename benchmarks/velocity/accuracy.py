"""Velocity estimates against known velocities, in many circumstances: a table in Markdown.

    python -m benchmarks.velocity.accuracy plume-1/truth.npz jet-1/truth.npz ...

`benchmarks.truth` bakes such files. Estimates do not know where smoke enters, except in the row "inlet known". Figures
are means over at least eight frames, inside the smoke and the two voxels around it, without the cells of the inlet,
which have a column of their own. Time is in Poisson solves of the same grid (`benchmarks.machine.poisson_seconds`).
"""

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks.machine import poisson_seconds
from benchmarks.tables import markdown
from benchmarks.velocity.pairs import away_from, near_smoke
from smokelift.baselines.paper_method import PaperVelocity
from smokelift.checks import Array
from smokelift.evaluation.metrics import volume_error
from smokelift.evaluation.truth import Truth
from smokelift.scene import Side
from smokelift.velocity import CoarseToFine, DensityPair, Velocity, VelocityEstimator

PAIRS = range(6, 38, 4)
CHAIN = range(6, 22)
SETTLED = 8
"""Frames of a chain that are not scored: its first estimates have no prediction yet."""


@dataclass(frozen=True)
class Score:
    """How near an estimate is to the truth.

    Attributes
    ----------
    error
        Relative L2 error of the velocity.
    cosine
        Cosine of the angle between the two velocity fields, each taken as one vector.
    mean
        Mean speed, relative to the truth's.
    inlet
        Relative L2 error in the cells where smoke enters.
    solves
        Time in Poisson solves.
    """

    error: float
    cosine: float
    mean: float
    inlet: float
    solves: float


def score(truth: Truth, frame: int, found: Velocity, solves: float, step: int = 1) -> Score:
    """Compare an estimate over `step` frames with the mean of their true velocities."""
    after, inlet = truth.density(frame + step), truth.inflow(frame + step)
    near = near_smoke(after)
    moving, entering = near & away_from(inlet), near & inlet
    u, v = found.centres(), np.mean([truth.velocity(frame + k).centres() for k in range(step)], axis=0)
    speed, true_speed = np.linalg.norm(u[moving], axis=-1), np.linalg.norm(v[moving], axis=-1)
    return Score(
        volume_error(u, v, moving),
        float(np.sum(u[moving] * v[moving]) / np.linalg.norm(u[moving]) / np.linalg.norm(v[moving])),
        float(speed.mean() / true_speed.mean()),
        volume_error(u, v, entering) if entering.any() else np.nan,
        solves,
    )


def pairs(
    truth: Truth,
    estimator: VelocityEstimator,
    unit: float,
    change: Callable[[Array], Array] = lambda density: density,
    known_inlet: bool = False,
    step: int = 1,
) -> Iterator[Score]:
    """Score estimates from two densities each, without a prediction."""
    for frame in PAIRS:
        before, after = (change(truth.density(f)) for f in (frame, frame + step))
        start = time.perf_counter()
        inflow = truth.inflow(frame + step) if known_inlet else None
        found = estimator.estimate(DensityPair(before, after, step * truth.dt, truth.voxel_size, inflow=inflow))
        yield score(truth, frame, found, (time.perf_counter() - start) / unit, step)


def chain(truth: Truth, unit: float, closed: tuple[Side, ...] = ()) -> Iterator[Score]:
    """Score estimates whose prediction is the estimate of the frame before."""
    for frame, (seconds, found) in zip(CHAIN, estimates(truth, closed), strict=True):
        if frame >= CHAIN.start + SETTLED:
            yield score(truth, frame, found, seconds / unit)


def estimates(truth: Truth, closed: tuple[Side, ...] = ()) -> Iterator[tuple[float, Velocity]]:
    """Yield the estimates of a chain of frames with their times (s)."""
    estimator, prediction = CoarseToFine(), None
    for frame in CHAIN:
        pair = DensityPair(truth.density(frame), truth.density(frame + 1), truth.dt, truth.voxel_size, closed)
        start = time.perf_counter()
        found = estimator.estimate(pair, prediction)
        prediction = estimator.predict(found, truth.dt)
        yield time.perf_counter() - start, found


def blurred(density: Array) -> Array:
    """Blur by one voxel: reconstructed densities are as smooth."""
    return np.asarray(ndimage.gaussian_filter(density, 1.0), np.float32)


def noisy(fraction: float) -> Callable[[Array], Array]:
    """Return what adds white noise to smoke, of a standard deviation relative to the largest density."""
    rng = np.random.default_rng(0)

    def change(density: Array) -> Array:
        noise = fraction * density.max() * rng.standard_normal(density.shape).astype(np.float32)
        return np.asarray(np.maximum(density + noise * (density > 0), 0))

    return change


def table(path: Path) -> list[list[str]]:
    """Return the rows of one scene."""
    truth = Truth.load(path)
    unit = poisson_seconds(truth.shape)
    usual = CoarseToFine()
    rows: dict[str, Iterator[Score]] = {
        "pairs": pairs(truth, usual, unit),
        "after 8 frames": chain(truth, unit),
        "after 8 frames, walls known": chain(truth, unit, truth.closed),
        "pairs, inlet known": pairs(truth, usual, unit, known_inlet=True),
        "pairs, paper": pairs(truth, PaperVelocity(), unit),
        "pairs, blurred": pairs(truth, usual, unit, blurred),
        "pairs, noise 1 %": pairs(truth, usual, unit, noisy(0.01)),
        "pairs, noise 3 %": pairs(truth, usual, unit, noisy(0.03)),
        "pairs, noise 10 %": pairs(truth, usual, unit, noisy(0.10)),
        "pairs, every second frame": pairs(truth, usual, unit, step=2),
    }
    cells = []
    for name, scores in rows.items():
        found = list(scores)
        means = [f"{np.nanmean([getattr(s, f.name) for s in found]):.2f}" for f in fields(Score)[:-1]]
        worst, solves = max(s.error for s in found), np.median([s.solves for s in found])
        cells.append([path.parent.name, name, *means, f"{worst:.2f}", f"{solves:.0f}"])
    return cells


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("truths", nargs="+", type=Path, metavar="TRUTH.npz")
    options = parser.parse_args()
    names = [field.name for field in fields(Score)]
    rows = [row for path in options.truths for row in table(path)]
    print(markdown(["scene", "", *names[:-1], "worst", names[-1]], rows))


if __name__ == "__main__":
    main()
