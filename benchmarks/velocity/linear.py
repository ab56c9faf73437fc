"""The quadratic problem of one linearisation, as the estimate meets it on its finest grid, and its two solvers.

The densities are linearised around the motion that the next coarser grids found, where the solvers begin too; the
regulariser's centre is rest. The reference is what projected conjugate gradients reach when nothing stops them but the
limit of single precision.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from benchmarks.velocity.pairs import Pair, relative_error
from smokelift.transport import Array, Faces, Velocity, closed_flags
from smokelift.velocity import VelocitySettings, estimate_velocity
from smokelift.velocity.linear import Linearisation, least_squares, linearise, solve
from smokelift.velocity.noise import followed
from smokelift.velocity.pyramid import Level, pyramid, refine

Solver = Literal["projected-cg", "primal-dual"]


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """A problem and where its solvers begin."""

    settings: VelocitySettings
    linear: Linearisation
    start: Faces
    counted: npt.NDArray[np.bool_]

    @staticmethod
    def of_pair(pair: Pair) -> LinearProblem:
        """The problem of two densities; known inlets count for nothing.

        Raises
        ------
        ValueError
            If nothing in the densities could show motion.
        """
        settings = VelocitySettings()
        clean = followed(pair.before, pair.after, settings.blur, settings.smoke_threshold, settings.threads)
        finest = Level(clean.before, clean.after, (~pair.inlet).astype(np.float32))
        coarse = pyramid(finest, 2)[0]
        found = estimate_velocity(
            coarse.before, coarse.after, 1.0, 1.0, replace(settings, levels=settings.grids - 1, blur=0.0)
        )
        closed = closed_flags(settings.closed)
        start = refine(found.faces, clean.after.shape, closed, settings.threads)
        linear = linearise(finest, start, False, settings)
        if linear is None:
            raise ValueError("There is no smoke with structure between these frames to follow.")
        return LinearProblem(settings, linear, start, pair.counted)

    def solve(self, solver: Solver, iterations: int) -> Array:
        """Make so many iterations; the velocity at voxel centres (nx, ny, nz, 3), in voxels a frame."""
        settings = replace(
            self.settings,
            solver=solver,
            iterations=iterations,
            tolerance=0.0,
            primal_dual_iterations=iterations,
            absolute_tolerance=0.0,
            relative_tolerance=0.0,
        )
        problem = least_squares(self.linear, _rest(self.counted.shape), 1.0, settings)
        faces, _ = solve(problem, self.start, settings)
        return Velocity(faces, 1.0).centres()

    def distance(self, found: Array, optimum: Array) -> float:
        """Relative L2 distance in the smoke and around it."""
        return relative_error(found, optimum, self.counted)


def _rest(shape: tuple[int, ...]) -> Faces:
    nx, ny, nz = shape
    return Velocity.zero((nx, ny, nz), 1.0).faces
