"""The velocity that carries one density into the next.

Two densities say how fast smoke moves along their gradient; that the flow has no divergence and is smooth
says the rest. The estimate minimises

    sum W (r + g . (u - u_k))^2 + R(u - u_p)      subject to div u = 0

over velocities u on voxel faces, in voxels per frame, with

    r = (after(x) - before(x - u_k(x))) / s       what the estimate so far, u_k, leaves unexplained
    g = grad (after(x) + before(x - u_k(x))) / 2s
    s = root mean square of |grad| inside the smoke
    W = 0 where smoke enters, else 1
    R(v) = irrotational * sum outside the smoke of |curl v|^2
         + smoothness * sum |grad curl v|^2  (or |grad v|^2, method "paper")
         + kinetic * sum |v|^2

from coarse to fine grids, linearised anew after every solve. Dividing by s makes every weight independent of
the scales of density, space and time.

Sources: Cen, Zhang, Liang (2023), Entropy 25, 1348, section 3.3 and algorithm 5 (method "paper"); Chambolle
and Pock (2011), J. Math. Imaging Vis. 40, 120; Eckert et al. (2019), ACM TOG 38(6), 239 (ScalarFlow).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift import _core
from smokelift.transport import (
    Array,
    Faces,
    Side,
    Velocity,
    advect,
    at_centres,
    closed_flags,
    face_shapes,
    project,
    require_positive,
    require_same_shape,
)

__all__ = ["Velocity", "VelocitySettings", "estimate_velocity", "predict_velocity"]

REACH = np.float32(1.0)
"""Voxels of the grid at hand up to which a linearisation of the density holds."""


@dataclass(frozen=True)
class VelocitySettings:
    """How a velocity is estimated. Weights have no unit: see the module's formula.

    Attributes
    ----------
    method
        ``"default"``, or ``"paper"``: one grid, one linearisation, first-order smoothness, primal-dual.
    solver
        ``"projected-cg"``, conjugate gradients on velocities without divergence; ``"primal-dual"``, the
        paper's splitting, with the same minimum at several times the cost; ``"auto"``: the one of the method.
    levels
        Grids, each half as fine as the one before. Three reach motion of several voxels a frame; at one to
        three voxels, two do as well (measured), and fine detail aliases on coarse grids.
    warps
        Linearisations on each grid. A second gains a few hundredths of error, a third nothing (measured).
    smoothness
        Weight of the differences of vorticity (default) or velocity (paper). Three times less lost on
        puff, three times more on plume.
    irrotational
        Weight of vorticity where there is no smoke, and so nothing that could show it.
    kinetic
        Weight of velocity itself. Only there to hold what nothing else does; more makes everything slower.
    trust
        Factor of a prediction: 1 takes it as it is, 0 leaves it out. Below one, so that
        errors die out; 0.9 and 0.97 differ by 0.01 in error.
    smoke_threshold
        Fraction of the largest density from which a voxel counts as smoke.
    blur
        Standard deviation in voxels of the Gaussian that takes noise off the densities; 0 if they are smooth.
    tolerance
        Projected CG stops at this fraction of the (preconditioned) gradient at rest. From 0.03 to 0.01 the
        error against known velocities still fell by a tenth; tighter is not worth its time.
    iterations
        Limit for each solve; a few tens are usual.
    sigma, tau, theta
        Primal-dual: dual step, primal step (the paper's gamma) and over-relaxation; sigma * tau <= 1. Ten
        times smaller sigma or larger tau is further from the minimum after the same time.
    absolute_tolerance, relative_tolerance
        Primal-dual: stops when the change is at most sqrt(3) absolute sqrt(voxels) + relative |u|, in voxels
        per frame: two in a hundred from the minimum.
    inner_tolerance, inner_iterations
        Primal-dual: by how much, and in how many steps at most, the conjugate gradients in each proximal
        operator reduce their residual. Less exact costs less and changes nothing.
    closed
        Sides of the box that are walls. None by default: the box of a video is cut out of the air around the
        smoke, which goes in and out through it freely. A floor, say, is ``("z-",)``.
    threads
        Processor cores; 0 takes all. The result is the same for any number.
    """

    method: Literal["default", "paper"] = "default"
    solver: Literal["auto", "projected-cg", "primal-dual"] = "auto"
    levels: int = 3
    warps: int = 2
    smoothness: float = 0.03
    irrotational: float = 0.3
    kinetic: float = 0.003
    trust: float = 0.9
    smoke_threshold: float = 0.01
    blur: float = 0.5
    tolerance: float = 0.01
    iterations: int = 100
    sigma: float = 0.1
    tau: float = 10.0
    theta: float = 1.0
    absolute_tolerance: float = 1e-4
    relative_tolerance: float = 1e-3
    inner_tolerance: float = 0.3
    inner_iterations: int = 50
    closed: tuple[Side, ...] = ()
    threads: int = 0


def estimate_velocity(
    before: npt.NDArray[np.floating[Any]],
    after: npt.NDArray[np.floating[Any]],
    dt: float,
    voxel_size: float,
    settings: VelocitySettings | None = None,
    *,
    inflow: npt.NDArray[np.bool_] | None = None,
    prediction: Velocity | None = None,
) -> Velocity:
    """Estimate the velocity that carries one density into the next.

    Parameters
    ----------
    before, after
        Densities >= 0, shape (nx, ny, nz).
    dt
        Time between them in seconds.
    voxel_size
        Edge of a voxel in metres.
    settings
        See `VelocitySettings`.
    inflow
        True in voxels where smoke enters, shape (nx, ny, nz): changes there are not taken for motion.
    prediction
        What the velocity should be near, such as `predict_velocity` of the frame before.

    Returns
    -------
    Velocity
        In m/s, without divergence, such that after(x) = before(x - u(x) dt). `figures` has ``iterations``,
        ``products`` and ``projections`` of the whole estimate, the last ``residual`` of the solver and the
        ``divergence`` (max |div u| voxel size / max |u|). Zero if there is no smoke or no motion.

    Raises
    ------
    ValueError
        If shapes differ, a density is negative or not finite, `dt` or `voxel_size` is not positive, or the
        steps of the primal-dual splitting do not converge.
    """
    settings = VelocitySettings() if settings is None else settings
    require_positive("dt", dt)
    require_positive("voxel_size", voxel_size)
    first, second = _density("before", before), _density("after", after)
    require_same_shape("after", second.shape, first.shape)
    nx, ny, nz = shape = first.shape
    weight = np.ones(shape, np.float32)
    if inflow is not None:
        require_same_shape("inflow", inflow.shape, shape)
        weight[inflow] = 0
    if settings.blur > 0:
        first, second = (ndimage.gaussian_filter(a, settings.blur) for a in (first, second))
    centre = _zero_faces(shape)
    if prediction is not None:
        require_same_shape("the prediction", prediction.shape, shape)
        x, y, z = prediction.displacement(dt * settings.trust)
        centre = x, y, z

    u: Faces | None = None
    totals = {"iterations": 0, "products": 0, "projections": 0, "residual": 0.0}
    levels, warps = (1, 1) if settings.method == "paper" else (settings.levels, settings.warps)
    for level in _pyramid(_Level(first, second, weight, centre), levels):
        u = level.centre if u is None else _finer(u, level.before.shape, settings)
        for _ in range(warps):
            problem = _linearise(level, u, settings)
            if problem is None:
                return Velocity.zero((nx, ny, nz), voxel_size)
            solution, figures = _solve(problem, u, settings)
            u = solution if settings.method == "paper" else _within_reach(solution, u, settings)
            for name in ("iterations", "products", "projections"):
                totals[name] += figures[name]
            totals["residual"] = figures["residual"]
    assert u is not None
    closed = closed_flags(settings.closed)
    (x, y, z), divergence = _core.project(u, closed, passes=1, threads=settings.threads)
    scale = np.float32(voxel_size / dt)
    return Velocity((x * scale, y * scale, z * scale), voxel_size, {**totals, "divergence": divergence})


def predict_velocity(velocity: Velocity, dt: float, closed: tuple[Side, ...] = ()) -> Velocity:
    """The velocity of the next frame if no force acts: carried along by itself, then projected.

    Parameters
    ----------
    velocity
        Velocity of one frame.
    dt
        Time between frames in seconds.
    closed
        Sides of the box that are walls.

    Returns
    -------
    Velocity
        Without divergence.
    """
    return project(advect(velocity, velocity, dt), closed)


@dataclass(frozen=True)
class _Level:
    """One grid of the pyramid; `centre` is the prediction in voxels per frame of this grid."""

    before: Array
    after: Array
    weight: Array
    centre: Faces


def _pyramid(finest: _Level, levels: int) -> Iterator[_Level]:
    """Grids from the coarsest, which is left with at least eight voxels a side, to the given one."""
    result = [finest]
    while len(result) < levels and min(result[-1].before.shape) >= 16:
        last = result[-1]
        result.append(
            _Level(
                _halve(last.before),
                _halve(last.after),
                _halve(last.weight),
                _halve_faces(last.centre),
            )
        )
    return reversed(result)


def _linearise(level: _Level, u: Faces, settings: VelocitySettings) -> _core.LeastSquares | None:
    """The quadratic problem around `u`; none where there is no structure to follow."""
    threads = settings.threads
    warped = _core.advect_cells(level.before, u, False, True, threads)
    gx, gy, gz = _core.gradient((warped + level.after) * np.float32(0.5), threads)
    density = np.maximum(warped, level.after)
    smoke = density > settings.smoke_threshold * density.max()
    squares = (gx * gx + gy * gy + gz * gz)[smoke]
    scale = float(np.sqrt(squares.mean(dtype=np.float64))) if squares.size else 0.0
    if scale == 0.0:
        return None
    gx, gy, gz, offset = (a / np.float32(scale) for a in (gx, gy, gz, level.after - warped))
    paper = settings.method == "paper"
    # The problem is in the whole velocity u, not in its increment: r + g.(u - u_k) = (r - g.u_k) + g.u
    for g, motion in zip((gx, gy, gz), at_centres(u), strict=True):
        offset -= g * motion
    return _core.LeastSquares(
        direction=(gx, gy, gz),
        offset=offset,
        weight=level.weight,
        irrotational=np.where(smoke | paper, np.float32(0), np.float32(settings.irrotational)),
        centre=level.centre,
        first_order=settings.smoothness if paper else 0.0,
        second_order=0.0 if paper else settings.smoothness,
        kinetic=settings.kinetic,
        closed=closed_flags(settings.closed),
    )


def _solve(problem: _core.LeastSquares, u: Faces, settings: VelocitySettings) -> tuple[Faces, _core.Figures]:
    solver = settings.solver
    if solver == "auto":
        solver = "primal-dual" if settings.method == "paper" else "projected-cg"
    if solver == "projected-cg":
        (x, y, z), figures = problem.projected_cg(
            u, tolerance=settings.tolerance, limit=settings.iterations, threads=settings.threads
        )
    else:
        (x, y, z), figures = problem.primal_dual(
            u,
            sigma=settings.sigma,
            tau=settings.tau,
            theta=settings.theta,
            absolute=settings.absolute_tolerance * math.sqrt(u[0].size),
            relative=settings.relative_tolerance,
            limit=settings.iterations,
            inner_tolerance=settings.inner_tolerance,
            inner_limit=settings.inner_iterations,
            threads=settings.threads,
        )
    return (x, y, z), figures


def _within_reach(solution: Faces, u: Faces, settings: VelocitySettings) -> Faces:
    """The solution, with increments cut to what the linearisation around `u` can know.

    Beyond that the data term says nothing, and thin or noisy smoke would throw single wisps many voxels far.
    """
    increments = [new - old for new, old in zip(solution, u, strict=True)]
    if max(float(np.abs(a).max()) for a in increments) <= REACH:
        return solution
    cut = [old + np.clip(a, -REACH, REACH) for old, a in zip(u, increments, strict=True)]
    (x, y, z), _ = _core.project(cut, closed_flags(settings.closed), passes=1, threads=settings.threads)
    return x, y, z


def _finer(u: Faces, shape: tuple[int, ...], settings: VelocitySettings) -> Faces:
    """A velocity on the next finer grid, in its voxels, without divergence."""
    fine = []
    for axis, (component, target) in enumerate(zip(u, face_shapes(shape), strict=True)):
        for direction in range(3):
            # Faces coincide along their own axis; centres lie a quarter of a coarse voxel off.
            shift = 0.0 if direction == axis else -0.25
            component = _interpolate(component, direction, target[direction], shift)
        fine.append(2 * component)
    (x, y, z), _ = _core.project(fine, closed_flags(settings.closed), passes=1, threads=settings.threads)
    return x, y, z


def _interpolate(a: Array, axis: int, count: int, shift: float) -> Array:
    """Values at i/2 + shift, i = 0 ... count-1, along one axis; linear, the ends continued."""
    position = np.clip(np.arange(count) / 2 + shift, 0, a.shape[axis] - 1)
    low = np.minimum(position.astype(int), max(a.shape[axis] - 2, 0))
    high = np.minimum(low + 1, a.shape[axis] - 1)
    weight = (position - low).astype(np.float32).reshape([-1 if d == axis else 1 for d in range(3)])
    mixed: Array = a.take(low, axis) * (1 - weight) + a.take(high, axis) * weight
    return mixed


def _halve(a: Array, axes: tuple[int, ...] = (0, 1, 2)) -> Array:
    """Means of two along the given axes; an odd last one counts twice."""
    for axis in axes:
        if a.shape[axis] % 2:
            a = np.concatenate([a, a.take([-1], axis)], axis)
        shape = (*a.shape[:axis], a.shape[axis] // 2, 2, *a.shape[axis + 1 :])
        a = a.reshape(shape).mean(axis + 1, dtype=np.float32)
    return a


def _halve_faces(u: Faces) -> Faces:
    """A velocity on the next coarser grid, in its voxels."""
    coarse = []
    for axis, component in enumerate(u):
        across = tuple(d for d in range(3) if d != axis)
        cells = component.shape[axis] - 1
        every_second = np.minimum(np.arange((cells + 1) // 2 + 1) * 2, cells)
        coarse.append(np.float32(0.5) * _halve(component.take(every_second, axis), across))
    x, y, z = coarse
    return x, y, z


def _zero_faces(shape: tuple[int, ...]) -> Faces:
    x, y, z = (np.zeros(n, np.float32) for n in face_shapes(shape))
    return x, y, z


def _density(name: str, values: npt.NDArray[np.floating[Any]]) -> Array:
    if values.ndim != 3 or 0 in values.shape:
        raise ValueError(f"{name} must be a three-dimensional array, not one of shape {values.shape}.")
    if not np.isfinite(values).all():
        raise ValueError(f"{name} holds densities that are not finite.")
    if values.min() < 0:
        raise ValueError(f"{name} holds negative densities.")
    return np.ascontiguousarray(values, np.float32)
