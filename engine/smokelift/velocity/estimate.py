"""The velocity that carries one density into the next: the estimate."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

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
from smokelift.velocity.contrast import expanded
from smokelift.velocity.momentum import Motion, fit_motion
from smokelift.velocity.noise import Followed, followed, without_noise
from smokelift.velocity.pyramid import Level, pyramid, refine
from smokelift.velocity.settings import VelocitySettings
from smokelift.velocity.sources import source_weight

REACH = np.float32(1.0)
"""Voxels of the grid at hand up to which a linearisation of the density holds."""

CONFIDENCE_WIDTH = 2.0
"""Standard deviation in voxels over which gradients count: smoothness carries what they show about as far."""

WORTHLESS = 0.5
"""Share of the change left unexplained from which a prediction is not used: after a cut, say, or a gust."""


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
        True in voxels where smoke enters, shape (nx, ny, nz): changes there are not taken for motion, and others
        are not looked for, so it has to hold all of them. Without it, sources are looked for.
    prediction
        What the velocity should be near, such as `predict_velocity` of the frame before. How near is decided by how
        much of the change it explains; one that explains less than half is not used.

    Returns
    -------
    Velocity
        In m/s, without divergence, such that after(x) = before(x - u(x) dt), with the `confidence` and the `source`
        of every voxel. `figures` has ``iterations``, ``products`` and ``projections`` of the whole estimate, the last
        ``residual`` of the solver, the ``divergence`` (max |div u| voxel size / max |u|), the ``unexplained`` share of
        the change that the centre of the regulariser leaves, the ``trust`` in the prediction and the ``thinning``, the
        share of the smoke that dissolves in `dt`, below zero where all of it brightens. Zero if there is no smoke, or
        none in one of the two, or no motion.

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
    closed = closed_flags(settings.closed)
    weight = np.ones(shape, np.float32)
    if inflow is not None:
        require_same_shape("inflow", inflow.shape, shape)
        # blur and gradients take the change there one voxel further
        weight[ndimage.binary_dilation(inflow)] = 0
    paper = settings.method == "paper"
    peaks = sorted(float(density.max()) for density in (first, second))
    if not paper and peaks[0] <= settings.smoke_threshold * peaks[1]:
        return _appeared(first, second, dt, voxel_size)
    if paper:
        blurred = without_noise(first, second, (settings.blur,), settings.smoke_threshold)
        pair = Followed(*blurred, compressed=False)
    else:
        pair = followed(first, second, settings.blur, settings.smoke_threshold)
    predicted = _zero_faces(shape)
    if prediction is not None:
        require_same_shape("the prediction", prediction.shape, shape)
        predicted = prediction.displacement(dt)

    finest = Level(pair.before, pair.after, weight, predicted)
    search = settings.sources and inflow is None
    found = _paper(finest, settings) if paper else _default(finest, search, pair, settings)
    if found is None:
        return Velocity.zero((nx, ny, nz), voxel_size)
    (x, y, z), divergence = _core.project(found.u, closed, passes=1, threads=settings.threads)
    scale = np.float32(voxel_size / dt)
    return Velocity(
        (x * scale, y * scale, z * scale),
        voxel_size,
        {**found.figures, "divergence": divergence},
        confidence=found.confidence,
        source=found.source / np.float32(dt),
    )


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


@dataclass(frozen=True, eq=False)
class _Found:
    """A velocity in voxels per frame, and what is known about it."""

    u: Faces
    figures: dict[str, float]
    confidence: Array
    source: Array


@dataclass(frozen=True, eq=False)
class _Linearisation:
    """The change between two densities around a velocity: r + g . (u - u_k) = offset + direction . u."""

    direction: Faces
    offset: Array
    residual: Array  # not divided by the scale, as the others are
    carried: Array
    density: Array
    smoke: npt.NDArray[np.bool_]
    scale: float


def _paper(level: Level, settings: VelocitySettings) -> _Found | None:
    """The paper's estimate: one grid, one linearisation around rest."""
    start = level.prediction
    linear = _linearise(level, start, settings)
    if linear is None:
        return None
    u, figures = _solve(linear, level.weight, level.prediction, 1.0, start, settings)
    nothing = np.zeros_like(level.after)
    measures = {name: figures[name] for name in ("iterations", "products", "projections", "residual")}
    return _Found(u, measures, nothing + 1, nothing)


def _default(finest: Level, search: bool, pair: Followed, settings: VelocitySettings) -> _Found | None:
    """From coarse to fine, or straight on the finest grid where there is a prediction worth its name."""
    closed = closed_flags(settings.closed)
    known = _worthwhile(finest, search, pair.noise, settings)
    guided = known is not None
    if not guided:
        finest = replace(finest, prediction=_zero_faces(finest.after.shape))
    levels = [finest] if guided else pyramid(finest, settings.levels)
    share = 1.0 if guided else settings.momentum
    iterations = products = projections = 0
    motion: Motion
    u = levels[0].prediction
    for level in levels:
        if level is not levels[0]:
            u = refine(u, level.after.shape, closed, settings.threads)
        for warp in range(settings.warps):
            # before anything is known of the motion all of the change would be a source
            blind = not guided and warp == 0 and level is levels[0]
            if known is not None:
                (linear, weight), known = known, None
            else:
                change = _linearise(level, u, settings)
                if change is None:
                    return None
                linear = change
                weight = _weight(level, linear, search and not blind)
            if guided or level is not finest or level is levels[0]:
                motion = _fit(level, linear, weight, settings, share)
            elif warp == 0:  # twelve projections are too much for the finest grid
                motion = motion.finer()
            centre = motion.velocity(level.prediction, level.after, closed, settings.threads)
            linear = replace(linear, offset=linear.offset + np.float32(motion.thinning) * linear.carried)
            unexplained = _unexplained(linear, weight, centre, pair.noise / level.coarseness**3)
            stiffness = settings.unexplained / max(unexplained, settings.least_unexplained)
            solution, figures = _solve(linear, weight, centre, stiffness, centre if blind else u, settings)
            u = _within_reach(solution, u, settings)
            iterations += figures["iterations"]
            products += figures["products"]
            projections += figures["projections"]
    density = expanded if pair.compressed else np.positive
    shown = weight * (linear.direction[0] ** 2 + linear.direction[1] ** 2 + linear.direction[2] ** 2)
    shown = ndimage.gaussian_filter(shown, CONFIDENCE_WIDTH, truncate=3.0)
    measures = {
        "iterations": iterations,
        "products": products,
        "projections": projections,
        "residual": figures["residual"],
        "unexplained": unexplained,
        "trust": motion.trust,
        "thinning": 1 - float(density(np.array(1 - motion.thinning, np.float32))),
    }
    confidence = shown / (shown + np.float32(stiffness * settings.smoothness))
    carried = linear.carried * np.float32(linear.scale)
    source = (1 - weight) * np.maximum(density(finest.after) - density(carried), 0)
    return _Found(u, measures, confidence, source)


def _worthwhile(
    finest: Level, search: bool, noise: float, settings: VelocitySettings
) -> tuple[_Linearisation, Array] | None:
    """The change around the prediction and its weight, if the prediction as it stands explains it well enough."""
    if not any(component.any() for component in finest.prediction):
        return None
    linear = _linearise(finest, finest.prediction, settings)
    if linear is None:
        return None
    weight = _weight(finest, linear, search)
    return (linear, weight) if _unexplained(linear, weight, finest.prediction, noise) < WORTHLESS else None


def _linearise(level: Level, u: Faces, settings: VelocitySettings) -> _Linearisation | None:
    """The change around `u`; none where there is no structure to follow."""
    threads = settings.threads
    warped = _core.advect_cells(level.before, u, False, True, threads)
    gx, gy, gz = _core.gradient((warped + level.after) * np.float32(0.5), threads)
    density = np.maximum(warped, level.after)
    smoke = density > settings.smoke_threshold * density.max()
    squares = (gx * gx + gy * gy + gz * gz)[smoke]
    scale = float(np.sqrt(squares.mean(dtype=np.float64))) if squares.size else 0.0
    if scale == 0.0:
        return None
    residual = level.after - warped
    gx, gy, gz, offset = (a / np.float32(scale) for a in (gx, gy, gz, residual))
    # The problem is in the whole velocity u, not in its increment: r + g.(u - u_k) = (r - g.u_k) + g.u
    for g, motion in zip((gx, gy, gz), at_centres(u), strict=True):
        offset -= g * motion
    return _Linearisation((gx, gy, gz), offset, residual, warped / np.float32(scale), density, smoke, scale)


def _weight(level: Level, linear: _Linearisation, search: bool) -> Array:
    """What changes count as motion: what is known beforehand, and without the sources that show."""
    if not search:
        return level.weight
    return level.weight * source_weight(linear.residual, linear.density, linear.smoke, level.coarseness)


def _fit(level: Level, linear: _Linearisation, weight: Array, settings: VelocitySettings, share: float) -> Motion:
    """Trust and momentum on one grid."""
    return fit_motion(
        level.prediction,
        level.after,
        linear.direction,
        linear.offset,
        linear.carried,
        weight,
        share,
        closed_flags(settings.closed),
        settings.threads,
    )


def _unexplained(linear: _Linearisation, weight: Array, centre: Faces, noise: float) -> float:
    """Share of the squared change that a velocity leaves, beyond what noise of a variance accounts for."""
    left = linear.offset.copy()
    for g, motion in zip(linear.direction, at_centres(centre), strict=True):
        left += g * motion
    floor = noise / linear.scale**2 * float(weight[linear.smoke].sum(dtype=np.float64))
    whole, rest = (float((weight * r * r).sum(dtype=np.float64)) - floor for r in (linear.offset, left))
    return max(rest, 0.0) / whole if whole > 0 else 1.0


def _solve(
    linear: _Linearisation, weight: Array, centre: Faces, stiffness: float, start: Faces, settings: VelocitySettings
) -> tuple[Faces, _core.Figures]:
    """The minimum of the quadratic problem, and how it was found."""
    paper = settings.method == "paper"
    problem = _core.LeastSquares(
        direction=linear.direction,
        offset=linear.offset,
        weight=weight,
        irrotational=np.where(linear.smoke | paper, np.float32(0), np.float32(settings.irrotational)),
        centre=centre,
        first_order=settings.smoothness if paper else 0.0,
        second_order=0.0 if paper else stiffness * settings.smoothness,
        kinetic=stiffness * settings.kinetic,
        closed=closed_flags(settings.closed),
    )
    solver = settings.solver
    if solver == "auto":
        solver = "primal-dual" if paper else "projected-cg"
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


def _appeared(before: Array, after: Array, dt: float, voxel_size: float) -> Velocity:
    """Between smoke and none there is no motion to be seen: what is new has come in."""
    nx, ny, nz = after.shape
    unknown = np.zeros_like(after)
    source = np.maximum(after - before, 0) / np.float32(dt)
    return replace(Velocity.zero((nx, ny, nz), voxel_size), confidence=unknown, source=source)


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
