"""Two solvers of the quadratic problem: minimize it over velocities without divergence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import smokelift._core as _core
from smokelift.transport import StaggeredGrid


class Solver(Protocol):
    """A way to minimize a quadratic function over velocities without divergence."""

    def solve(self, problem: _core.LeastSquares, start: StaggeredGrid) -> tuple[StaggeredGrid, _core.Figures]:
        """Return the minimum, and how it was found.

        Parameters
        ----------
        problem
            The quadratic function, see `smokelift.velocity.linearization.least_squares`.
        start
            Without divergence, in voxels a frame.
        """
        ...


@dataclass(frozen=True)
class ProjectedCG:
    """Conjugate gradients on the velocities without divergence, preconditioned with constant coefficients.

    A solve stops at `tolerance`, a fraction of the preconditioned gradient at rest, or after so many `iterations`: ten
    are as exact against known velocities as a hundred (docs/experiments/velocity-solver.md).
    """

    tolerance: float = 0.01
    iterations: int = 10

    def solve(self, problem: _core.LeastSquares, start: StaggeredGrid) -> tuple[StaggeredGrid, _core.Figures]:
        """See `Solver`."""
        faces, figures = problem.projected_cg(start.faces, tolerance=self.tolerance, limit=self.iterations)
        return start.with_faces(faces), figures


@dataclass(frozen=True)
class PrimalDual:
    """Chambolle and Pock's splitting, as in algorithm 5 of Cen, Zhang and Liang (2023).

    Attributes
    ----------
    sigma, tau, theta
        Dual step, primal step (the paper's gamma) and over-relaxation; sigma * tau <= 1, or `solve` raises ValueError.
        The paper gives no values: docs/experiments/velocity-solver.md has the sweep.
    absolute_tolerance, relative_tolerance
        Stops when the change is at most sqrt(3) absolute sqrt(voxels) + relative |u|, in voxels a frame.
    iterations
        Limit of its steps. A few tens are usual; the paper gives none.
    inner_tolerance, inner_iterations
        By how much, and in how many steps at most, the conjugate gradients in each proximal operator reduce their
        residual.
    """

    sigma: float = 0.1
    tau: float = 10.0
    theta: float = 1.0
    absolute_tolerance: float = 1e-4
    relative_tolerance: float = 1e-3
    iterations: int = 100
    inner_tolerance: float = 0.3
    inner_iterations: int = 50

    def solve(self, problem: _core.LeastSquares, start: StaggeredGrid) -> tuple[StaggeredGrid, _core.Figures]:
        """See `Solver`."""
        faces, figures = problem.primal_dual(
            start.faces,
            sigma=self.sigma,
            tau=self.tau,
            theta=self.theta,
            absolute=self.absolute_tolerance * math.sqrt(start.faces[0].size),
            relative=self.relative_tolerance,
            limit=self.iterations,
            inner_tolerance=self.inner_tolerance,
            inner_limit=self.inner_iterations,
        )
        return start.with_faces(faces), figures
