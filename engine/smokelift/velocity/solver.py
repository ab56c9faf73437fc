"""Two solvers of the quadratic problem: minimize it over velocities without divergence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg.blas import saxpy

import smokelift._core as _core
from smokelift.checks import Array
from smokelift.transport import Faces, StaggeredGrid


class Solver(Protocol):
    """A way to minimize a quadratic function over velocities without divergence."""

    def solve(self, problem: _core.LeastSquares, start: StaggeredGrid) -> tuple[StaggeredGrid, _core.Figures]:
        """Return the minimum, and how it was found.

        Parameters
        ----------
        problem
            The quadratic function, see `smokelift.velocity.linearization.least_squares`.
        start
            Without divergence, in voxels per frame.
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
        faces, figures = problem.projected_cg(start.faces, tolerance=self.tolerance, limit=self.iterations)
        return start.with_faces(faces), figures


@dataclass(frozen=True)
class PrimalDual:
    """Chambolle and Pock's splitting, as in algorithm 5 of Cen, Zhang and Liang (2023), equations 14 to 16."""

    sigma: float = 0.1
    tau: float = 10.0
    theta: float = 1.0
    """Dual step, primal step (the paper's gamma) and over-relaxation; sigma * tau <= 1, or `solve` raises ValueError.
    The paper gives no values: docs/experiments/velocity-solver.md has the sweep."""
    absolute_tolerance: float = 1e-4
    relative_tolerance: float = 1e-3
    """Stops when the change is at most sqrt(3) absolute sqrt(voxels) + relative |u|, in voxels per frame."""
    iterations: int = 100
    """Limit of its steps. A few tens are usual; the paper gives none."""
    inner_tolerance: float = 0.3
    inner_iterations: int = 50
    """By how much, and in how many steps at most, the conjugate gradients in each proximal operator reduce their
    residual."""

    def solve(self, problem: _core.LeastSquares, start: StaggeredGrid) -> tuple[StaggeredGrid, _core.Figures]:
        # the two parts are coupled by the identity, whose norm is one; NaN is refused as well
        if not (self.sigma > 0 and self.tau > 0 and self.sigma * self.tau <= 1 and 0 <= self.theta <= 1):
            raise ValueError(
                f"primal-dual steps sigma = {self.sigma:g}, tau = {self.tau:g}, theta = {self.theta:g} do not "
                "converge: sigma and tau must be positive with sigma * tau <= 1, and theta in [0, 1]."
            )
        proximal = _Proximal(self, problem, start)
        absolute = self.absolute_tolerance * math.sqrt(3 * start.faces[0].size)
        figures: _core.Figures = {"iterations": 0, "products": 0, "projections": 0, "residual": 0.0}
        u = _flat(start.faces)
        fitted, relaxed, dual = u.copy(), u, np.zeros_like(u)
        converged = False
        while not converged and figures["iterations"] < self.iterations:
            # equation 14: X' = X + sigma Y - sigma prox_f(X / sigma + Y)
            proximal(dual / np.float32(self.sigma) + relaxed, fitted)
            dual += np.float32(self.sigma) * (relaxed - fitted)
            # u' = prox_g(u - tau X'), which is the projection (equation 16)
            stepped = _faces(u - np.float32(self.tau) * dual, start)
            before, u = u, _flat(_core.project(stepped, start.walls, passes=1)[0])
            # Y' = u' + theta (u' - u)
            relaxed = u + np.float32(self.theta) * (u - before)
            change, norm = float(np.linalg.norm(u - before)), float(np.linalg.norm(u))
            converged = change <= absolute + self.relative_tolerance * norm
            figures["residual"] = change / norm if norm > 0 else 0.0
            figures["iterations"] += 1
            figures["projections"] += 1
        figures["products"] = proximal.products
        return start.with_faces(_faces(u, start)), figures


class _Proximal:
    """Equation 15, in the projection's inner product: prox(xi) = argmin f(v) + sigma/2 |v - xi|^2.

    That is (A + sigma/2 w) v = b + sigma/2 w xi, by conjugate gradients with the diagonal as preconditioner. The
    weights w are 1/2 on open sides, where a face belongs to half a voxel, and 1 elsewhere.
    """

    def __init__(self, settings: PrimalDual, problem: _core.LeastSquares, like: StaggeredGrid) -> None:
        self._settings, self._problem, self._like = settings, problem, like
        weights = [np.ones_like(component) for component in like.faces]
        for axis, component in enumerate(weights):
            for side in (0, 1):
                if not like.walls[2 * axis + side]:
                    np.moveaxis(component, axis, 0)[-side] = 0.5
        self._coupling = np.float32(settings.sigma / 2) * _flat(weights)
        self._right = _flat(problem.right_hand_side())
        self._inverse = 1 / (_flat(problem.diagonal()) + np.float32(settings.sigma / 2))
        self.products = 0

    def __call__(self, xi: Array, v: Array) -> None:
        """Turn v (n,), the minimum for the last xi, into that for xi (n,)."""
        residual = self._right + self._coupling * xi - self._product(v)
        search = self._inverse * residual
        squared = float(np.vdot(residual, search))
        # relative to the start and not to the right-hand side: a warm start that passed unchanged would look like
        # convergence of the outer iteration
        goal = self._settings.inner_tolerance**2 * squared
        for _ in range(self._settings.inner_iterations):
            if squared <= goal:
                break
            product = self._product(search)
            step = squared / float(np.vdot(search, product))
            saxpy(search, v, a=step)
            saxpy(product, residual, a=-step)
            scaled = np.multiply(self._inverse, residual, out=product)
            before, squared = squared, float(np.vdot(residual, scaled))
            saxpy(search, scaled, a=squared / before)
            search = scaled

    def _product(self, v: Array) -> Array:
        self.products += 1
        product = _flat(self._problem.apply(_faces(v, self._like)))
        product += self._coupling * v
        return product


def _flat(faces: Sequence[Array]) -> Array:
    """The components of a velocity, one after the other (n,)."""
    return np.concatenate([component.ravel() for component in faces])


def _faces(vector: Array, like: StaggeredGrid) -> Faces:
    """The components that `_flat` joined."""
    ends = np.cumsum([component.size for component in like.faces])[:-1]
    parts = np.split(vector, ends)
    x, y, z = (part.reshape(component.shape) for part, component in zip(parts, like.faces, strict=True))
    return x, y, z
