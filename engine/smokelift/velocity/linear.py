"""The problem of one linearisation, and its solution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from smokelift import _core
from smokelift.transport import Array, Faces, closed_flags
from smokelift.velocity.pyramid import Level
from smokelift.velocity.settings import VelocitySettings
from smokelift.velocity.sources import left_unexplained, source_weight


@dataclass(frozen=True, eq=False)
class Linearisation:
    """The change between two densities around a velocity: r + g . (u - u_k) = offset + direction . u."""

    direction: Faces
    offset: Array
    carried: Array
    weight: Array
    smoke: npt.NDArray[np.bool_]
    scale: float


def linearise(level: Level, u: Faces, search: bool, settings: VelocitySettings) -> Linearisation | None:
    """The change around `u`; none where there is no structure to follow."""
    (gx, gy, gz), offset, residual, carried, density, smoke, scale = _core.linearise(
        level.before, level.after, u, settings.smoke_threshold, settings.threads
    )
    if scale == 0:
        return None
    weight = np.ascontiguousarray(level.weight)
    if search:
        unexplained = left_unexplained(residual, density, level.coarseness, level.past, settings.threads)
        weight = weight * source_weight(unexplained, smoke)
    return Linearisation((gx, gy, gz), offset, carried, weight, smoke, scale)


def least_squares(
    linear: Linearisation, centre: Faces, stiffness: float, settings: VelocitySettings
) -> _core.LeastSquares:
    """The quadratic problem."""
    paper = settings.method == "paper"
    return _core.LeastSquares(
        direction=linear.direction,
        offset=linear.offset,
        weight=linear.weight,
        irrotational=np.where(linear.smoke | paper, np.float32(0), np.float32(settings.irrotational)),
        centre=centre,
        first_order=settings.smoothness if paper else 0.0,
        second_order=0.0 if paper else stiffness * settings.smoothness,
        kinetic=stiffness * settings.kinetic,
        closed=closed_flags(settings.closed),
    )


def solve(problem: _core.LeastSquares, start: Faces, settings: VelocitySettings) -> tuple[Faces, _core.Figures]:
    """The minimum of the quadratic problem, and how it was found."""
    solver = settings.solver
    if solver == "auto":
        solver = "primal-dual" if settings.method == "paper" else "projected-cg"
    if solver == "projected-cg":
        (x, y, z), figures = problem.projected_cg(
            start, tolerance=settings.tolerance, limit=settings.iterations, threads=settings.threads
        )
    else:
        (x, y, z), figures = problem.primal_dual(
            start,
            sigma=settings.sigma,
            tau=settings.tau,
            theta=settings.theta,
            absolute=settings.absolute_tolerance * math.sqrt(start[0].size),
            relative=settings.relative_tolerance,
            limit=settings.primal_dual_iterations,
            inner_tolerance=settings.inner_tolerance,
            inner_limit=settings.inner_iterations,
            threads=settings.threads,
        )
    return (x, y, z), figures
