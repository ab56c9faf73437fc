"""Whole estimates against known motion, at several sizes.

A size is measured on the known scenes of that size, or on the built-in one where there is none. Scenes are not
resampled: a finer grid would show no finer detail, and a coarser one not what a solver makes at that size.

Machines differ and are shared, so a Poisson solve of the same grid is timed just before and just after all that is
measured, and times are given in these solves.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, TypeVar

import numpy as np

from benchmarks import machine
from benchmarks.errors import relative_error
from benchmarks.tables import size_text
from benchmarks.velocity.flow import built_in_pair
from benchmarks.velocity.pairs import Pair, frames_for_pairs, pair_of_truth
from smokelift.baselines.velocity import PaperVelocity
from smokelift.evaluation.truth import Truth
from smokelift.velocity import CoarseToFine, DensityPair, PrimalDual, ProjectedCG, VelocityEstimator, VelocitySettings

Shape = tuple[int, int, int]
Made = TypeVar("Made")
Say = Callable[[str], None]

LIBRARIES = ("numpy", "scipy")

ENOUGH_SECONDS = 2.0
MAX_RUNS = 5
"""Work is timed again until it took this long in all, or ran this often."""

BUILT_IN = "built-in"


@dataclass(frozen=True)
class Plan:
    """How much is measured at a size.

    Attributes
    ----------
    pairs
        Number of pairs of densities.
    iterations
        Numbers of iterations of projected CG in each solve of an estimate.
    primal_dual_iterations
        Numbers of iterations of primal-dual in each.
    others
        Further estimates, by the setting that differs.
    """

    pairs: int
    iterations: tuple[int, ...]
    primal_dual_iterations: tuple[int, ...]
    others: tuple[Mapping[str, Any], ...]


USUAL = Plan(
    pairs=3,
    iterations=(2, 3, 5, 10, 20),
    primal_dual_iterations=(2, 5, 20, 100),
    others=({"linearisations": 1}, {"linearisations": 3}, {"method": "paper"}),
)

SHORT = Plan(
    pairs=1,
    iterations=(2, 5, 10),
    primal_dual_iterations=(2,),
    others=({"linearisations": 1},),
)
"""The plan for large grids, where the usual one would take hours."""

MANY_VOXELS = 1 << 20
"""Most voxels of a grid with the usual plan."""


@dataclass(frozen=True)
class Variant:
    """One way to estimate, without a prediction.

    Attributes
    ----------
    setting
        What is varied: ``iterations``, ``primal_dual_iterations``, ``linearisations`` or ``method``.
    value
        The setting's value.
    default
        Whether these are the default settings.
    error
        Relative L2 error in the smoke, mean over the pairs.
    errors
        The error of each pair.
    seconds, solves
        Its time, in seconds and in Poisson solves; medians over the pairs.
    """

    setting: str
    value: int | str
    default: bool
    error: float
    errors: tuple[float, ...]
    seconds: float
    solves: float


def run(
    sizes: Sequence[Shape],
    truths: Sequence[tuple[str, Truth]],
    say: Say,
    save: Callable[[dict[str, Any]], None],
) -> dict[str, Any]:
    """Run the whole benchmark.

    Parameters
    ----------
    sizes
        Voxels along x, y and z.
    truths
        Known scenes with their names.
    say
        Takes a sentence about each step.
    save
        Gets the results so far after each size, in case the rest is cancelled.

    Returns
    -------
    dict
        ``date``, ``machine``, ``versions`` and ``sizes``: each with ``size``, ``scene`` (names, or "built-in"),
        ``voxels_a_frame`` (mean motion in the smoke), ``poisson_ms`` and ``estimates`` (of `Variant`). Ready for
        JSON.

    Raises
    ------
    ValueError
        If a known scene has too few frames or no smoke.
    """
    results: dict[str, Any] = {
        **machine.provenance(LIBRARIES),
        "sizes": [],
    }
    known = [
        (name, truth, frame)
        for name, truth in truths
        for frame in frames_for_pairs(name, truth, _plan(truth.shape).pairs)
    ]
    for shape in sizes:
        plan = _plan(shape)
        here = [(name, truth, frame) for name, truth, frame in known if truth.shape == shape]
        name = ", ".join(dict.fromkeys(name for name, _, _ in here)) or BUILT_IN
        say(f"{size_text(shape)}, {name}")
        pairs = [pair_of_truth(truth, frame) for _, truth, frame in here]
        if not pairs:
            pairs = [built_in_pair(shape, seed) for seed in range(plan.pairs)]
        clock = _Clock(shape)
        row: dict[str, Any] = {"size": shape, "scene": name, "voxels_a_frame": _mean_motion(pairs)}
        row["estimates"] = [asdict(estimate) for estimate in _estimates(pairs, plan, clock, say)]
        row["poisson_ms"] = 1e3 * float(np.median(clock.units))
        results["sizes"].append(row)
        save(results)
    return results


def _plan(shape: Shape) -> Plan:
    return USUAL if math.prod(shape) <= MANY_VOXELS else SHORT


class _Clock:
    """Times work on one grid, in seconds and in Poisson solves just before and just after."""

    def __init__(self, shape: Shape) -> None:
        self._shape = shape
        self.units: list[float] = []

    def time(self, work: Callable[[], Made]) -> tuple[float, float, Made]:
        """Return seconds and solves, medians, and the result of the work."""
        seconds: list[float] = []
        solves: list[float] = []
        before = self._unit()
        while len(seconds) < MAX_RUNS and sum(seconds) < ENOUGH_SECONDS:
            began = time.perf_counter()
            made = work()
            seconds.append(time.perf_counter() - began)
            after = self._unit()
            solves.append(2 * seconds[-1] / (before + after))
            before = after
        return float(np.median(seconds)), float(np.median(solves)), made

    def _unit(self) -> float:
        self.units.append(machine.poisson_seconds(self._shape))
        return self.units[-1]


def _estimates(pairs: Sequence[Pair], plan: Plan, clock: _Clock, say: Say) -> list[Variant]:
    ways = [{"iterations": count} for count in plan.iterations]
    ways += [{"primal_dual_iterations": count} for count in plan.primal_dual_iterations]
    estimates = []
    for way in (*ways, *plan.others):
        ((setting, value),) = way.items()
        estimator = _estimator(setting, value)
        found = [_against_truth(pair, estimator, clock) for pair in pairs]
        errors = tuple(error for error, _, _ in found)
        seconds, solves = (float(np.median(column)) for column in list(zip(*found, strict=True))[1:])
        default = estimator == CoarseToFine()
        estimates.append(Variant(setting, value, default, float(np.mean(errors)), errors, seconds, solves))
        say(f"  {setting} {value}: error {estimates[-1].error:.3f}, {solves:.0f} solves")
    return estimates


def _estimator(setting: str, value: Any) -> VelocityEstimator:
    """The default estimator with one thing changed, or the paper's."""
    if setting == "method":
        return PaperVelocity()
    if setting == "iterations":
        return CoarseToFine(VelocitySettings(solver=ProjectedCG(iterations=value)))
    if setting == "primal_dual_iterations":
        return CoarseToFine(VelocitySettings(solver=PrimalDual(iterations=value)))
    return CoarseToFine(replace(VelocitySettings(), **{setting: value}))


def _against_truth(pair: Pair, estimator: VelocityEstimator, clock: _Clock) -> tuple[float, float, float]:
    """Return error, seconds and solves."""
    densities = DensityPair(pair.before, pair.after, 1.0, 1.0)
    seconds, solves, found = clock.time(lambda: estimator.estimate(densities))
    return relative_error(found.centres(), pair.motion, pair.counted), seconds, solves


def _mean_motion(pairs: Sequence[Pair]) -> float:
    return float(np.mean([np.linalg.norm(pair.motion[pair.counted], axis=-1).mean() for pair in pairs]))
