"""The quadratic problem of one linearisation on the finest grid of an estimate, and its two solvers.

The densities are linearised around the velocity of the next coarser grids, where the solvers begin too; the regulariser
pulls towards rest. The reference is where projected conjugate gradients end if only single precision stops them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.errors import relative_error
from benchmarks.velocity.pairs import Mask, Pair
from smokelift.transport import Array, StaggeredGrid
from smokelift.velocity import PrimalDual, ProjectedCG, Solver, VelocitySettings, estimate_velocity
from smokelift.velocity.linearisation import Linearisation, Regularisation, least_squares, linearise
from smokelift.velocity.preparation import prepare
from smokelift.velocity.pyramid import Level, pyramid, refine


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """A problem and where its solvers begin."""

    settings: VelocitySettings
    linear: Linearisation
    start: StaggeredGrid
    counted: Mask

    @staticmethod
    def of_pair(pair: Pair) -> LinearProblem:
        """Return the problem of two densities; voxels of known inlets have no weight.

        Raises
        ------
        ValueError
            If the densities have no structure that could show motion.
        """
        settings = VelocitySettings()
        clean = prepare(pair.before, pair.after, settings)
        finest = Level(clean.before, clean.after, (~pair.inlet).astype(np.float32))
        coarse = pyramid(finest, 2)[0]
        found = estimate_velocity(
            coarse.before, coarse.after, 1.0, 1.0, replace(settings, levels=settings.grids - 1, blur=0.0)
        )
        start = refine(found, clean.after.shape)
        linear = linearise(finest, start, settings.smoke_threshold, None)
        if linear is None:
            raise ValueError("There is no smoke with structure between these frames to follow.")
        return LinearProblem(settings, linear, start, pair.counted)

    def solve(self, solver: Solver) -> Array:
        """Return a solver's velocity at voxel centres (nx, ny, nz, 3), in voxels a frame."""
        rest = StaggeredGrid.zero(self.counted.shape, 1.0)
        terms = Regularisation(
            second_order=self.settings.smoothness,
            kinetic=self.settings.kinetic,
            irrotational=self.settings.irrotational,
        )
        found, _ = solver.solve(least_squares(self.linear, rest, terms), self.start)
        return found.centres()

    def distance(self, found: Array, optimum: Array) -> float:
        """Return the relative L2 distance in the smoke and around it."""
        return relative_error(found, optimum, self.counted)


def endless(name: str, iterations: int) -> Solver:
    """Return a solver that only its number of iterations stops."""
    if name == "projected-cg":
        return ProjectedCG(tolerance=0.0, iterations=iterations)
    return PrimalDual(absolute_tolerance=0.0, relative_tolerance=0.0, iterations=iterations)
