"""The velocity that carries one density into the next: the estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift import _core
from smokelift.scene import Side
from smokelift.transport import (
    Array,
    Faces,
    Velocity,
    advect,
    closed_flags,
    face_shapes,
    project,
    require_positive,
    require_same_shape,
)
from smokelift.velocity.contrast import expanded
from smokelift.velocity.linear import Linearisation, least_squares, linearise, solve
from smokelift.velocity.momentum import Motion, Prediction, fit_motion
from smokelift.velocity.noise import Followed, followed, without_noise
from smokelift.velocity.pyramid import Level, halve, halve_faces, pyramid, refine
from smokelift.velocity.settings import VelocitySettings
from smokelift.velocity.sources import Unexplained, left_unexplained

REACH = 1.0
"""Voxels of the grid at hand up to which a linearisation of the density holds."""

CONFIDENCE_WIDTH = 2.0
"""Standard deviation in voxels over which gradients count: smoothness carries what they show about as far."""

SMALL_STEP = np.float32(0.08)
"""Voxels. A solve that changed a prediction by less is not linearised around again: with 0.05, as after predictions of
steady flows, errors stay the same to 0.01, and a third of the time is saved; with 0.1, as in fast jets, they do not."""

LARGE = 500_000
"""Voxels. A finest grid of more is linearised once: that takes a third less time and costs 0.01 of error at 128 x 128 x
192; at 64 x 64 x 96, where the coarser grids know less, it costs up to 0.02."""

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
    if inflow is not None:
        require_same_shape("inflow", inflow.shape, shape)
    if prediction is not None:
        require_same_shape("the prediction", prediction.shape, shape)
    paper = settings.method == "paper"
    peaks = sorted(float(density.max()) for density in (first, second))
    if not paper and peaks[0] <= settings.smoke_threshold * peaks[1]:
        return _appeared(first, second, dt, voxel_size)
    if settings.halvings and not paper:
        coarser = replace(settings, halvings=settings.halvings - 1)
        return _on_half_grid(first, second, dt, voxel_size, coarser, inflow, prediction)
    weight: Array = np.broadcast_to(np.float32(1), shape)
    if inflow is not None:
        # blur and gradients take the change there one voxel further
        weight = (~ndimage.binary_dilation(inflow)).astype(np.float32)
    if paper:
        blurred, _ = without_noise(
            first, second, ((settings.blur, np.inf),), settings.smoke_threshold, settings.threads
        )
        pair = Followed(*blurred, compressed=False)
    else:
        pair = followed(first, second, settings.blur, settings.smoke_threshold, settings.threads)
    predicted = past = None
    if prediction is not None:
        past = Unexplained(*prediction.unexplained) if prediction.unexplained is not None else None
        predicted = Prediction(prediction.faces, dt / voxel_size)

    finest = Level(pair.before, pair.after, weight, past=past)
    search = settings.sources and inflow is None
    found = _paper(finest, predicted, settings) if paper else _default(finest, predicted, search, pair, settings)
    if found is None:
        return Velocity.zero((nx, ny, nz), voxel_size)
    (x, y, z), divergence = _core.project(found.u, closed, passes=1, threads=settings.threads)
    for component in (x, y, z):
        component *= np.float32(voxel_size / dt)
    return Velocity(
        (x, y, z),
        voxel_size,
        {**found.figures, "divergence": divergence},
        confidence=found.confidence,
        source=found.source / np.float32(dt),
        unexplained=None if found.unexplained is None else (found.unexplained.mean, found.unexplained.magnitude),
    )


def predict_velocity(velocity: Velocity, dt: float, closed: tuple[Side, ...] = (), *, halvings: int = 0) -> Velocity:
    """The velocity of the next frame if no force acts: carried along by itself, then projected.

    Parameters
    ----------
    velocity
        Velocity of one frame.
    dt
        Time between frames in seconds.
    closed
        Sides of the box that are walls.
    halvings
        Carry it on a coarser grid: see `VelocitySettings`.

    Returns
    -------
    Velocity
        Without divergence; `unexplained` stays as it is, because inlets stand still.
    """
    if halvings:
        coarse = predict_velocity(_halved(velocity), dt, closed, halvings=halvings - 1)
        return _refined(coarse, velocity.shape, closed)
    return replace(project(advect(velocity, velocity, dt), closed), unexplained=velocity.unexplained)


def _on_half_grid(
    before: Array,
    after: Array,
    dt: float,
    voxel_size: float,
    settings: VelocitySettings,
    inflow: npt.NDArray[np.bool_] | None,
    prediction: Velocity | None,
) -> Velocity:
    """The estimate from densities half as fine, with the settings for these."""
    nx, ny, nz = before.shape
    found = estimate_velocity(
        halve(before),
        halve(after),
        dt,
        2 * voxel_size,
        settings,
        inflow=None if inflow is None else halve(inflow.astype(np.float32)) > 0,
        prediction=None if prediction is None else _halved(prediction),
    )
    return _refined(found, (nx, ny, nz), settings.closed, settings.threads)


def _halved(velocity: Velocity) -> Velocity:
    """A velocity on a grid half as fine; what was left unexplained is on that already."""
    return Velocity(halve_faces(velocity.faces), 2 * velocity.voxel_size, unexplained=velocity.unexplained)


def _refined(coarse: Velocity, shape: tuple[int, int, int], closed: tuple[Side, ...], threads: int = 0) -> Velocity:
    """A velocity on a grid twice as fine, without divergence there; what was left unexplained stays as it is."""
    x, y, z = refine(coarse.faces, shape, closed_flags(closed), threads)
    for component in (x, y, z):
        component *= np.float32(0.5)  # refined are voxels, of which there are twice as many to the way
    figures = dict(coarse.figures)
    if figures:
        largest = max(float(np.abs(component).max()) for component in (x, y, z))
        left = float(np.abs(_core.divergence((x, y, z), threads)).max())
        figures["divergence"] = left / largest if largest > 0 else 0.0
    confidence, source = (
        None if values is None else values.repeat(2, 0).repeat(2, 1).repeat(2, 2)[: shape[0], : shape[1], : shape[2]]
        for values in (coarse.confidence, coarse.source)
    )
    return Velocity((x, y, z), coarse.voxel_size / 2, figures, confidence, source, coarse.unexplained)


@dataclass(frozen=True, eq=False)
class _Found:
    """A velocity in voxels per frame, and what is known about it."""

    u: Faces
    figures: dict[str, float]
    confidence: Array
    source: Array
    unexplained: Unexplained | None


def _paper(level: Level, prediction: Prediction | None, settings: VelocitySettings) -> _Found | None:
    """The paper's estimate: one grid, one linearisation around rest."""
    start = _zero_faces(level.after.shape) if prediction is None else prediction.displacement()
    linear = linearise(level, start, False, settings)
    if linear is None:
        return None
    u, figures = solve(least_squares(linear, start, 1.0, settings), start, settings)
    nothing = np.zeros_like(level.after)
    measures = {name: figures[name] for name in ("iterations", "products", "projections", "residual")}
    return _Found(u, measures, nothing + 1, nothing, None)


def _default(
    finest: Level, prediction: Prediction | None, search: bool, pair: Followed, settings: VelocitySettings
) -> _Found | None:
    """From coarse to fine, or straight on the finest grid where there is a prediction worth its name."""
    closed, threads = closed_flags(settings.closed), settings.threads
    known = _worthwhile(finest, prediction, search, pair.noise, settings)
    guided = known is not None
    if not guided:
        prediction, finest = None, replace(finest, past=None)
    levels = [finest] if guided else pyramid(finest, settings.grids)
    share = 1.0 if guided else settings.momentum
    iterations = products = projections = 0
    motion: Motion
    u = _zero_faces(levels[0].after.shape) if prediction is None else prediction.displacement()
    coarsest = True
    warps_on_finest = 1 if finest.after.size > LARGE else settings.warps
    while levels:  # a grid that is done with is not kept
        level = levels.pop(0)
        if not coarsest:
            u = refine(u, level.after.shape, closed, threads)
        warps = warps_on_finest if level is finest else settings.warps
        for warp in range(warps):
            # before anything is known of the motion all of the change would be a source
            blind = not guided and warp == 0 and coarsest
            linear, known = known or linearise(level, u, search and not blind, settings), None
            if linear is None:
                return None
            if coarsest or level is not finest:
                motion = _fit(level, prediction, linear, share, settings)
            elif warp == 0:  # twelve projections are too much for the finest grid
                motion = motion.finer()
            centre = motion.velocity(prediction, level.after, closed, threads)
            linear = _thinned(linear, motion.thinning)
            unexplained, _ = _unexplained(linear, centre, pair.noise / level.coarseness**3, settings)
            stiffness = settings.unexplained / max(unexplained, settings.least_unexplained)
            problem, start = least_squares(linear, centre, stiffness, settings), centre if blind else u
            evidence, smoke = (linear.direction, linear.weight), linear.smoke
            # The solver takes most of the memory: what it does not look at goes before, what it leaves after.
            del linear, centre
            solution, figures = solve(problem, start, settings)
            del problem, start
            last = warp == warps - 1 or (guided and _step(solution, u, smoke) < SMALL_STEP)
            if level is finest and last:
                source, left = _source(level, u, evidence[1], settings, pair.compressed)
                confidence = _confidence(*evidence, stiffness, settings)
            u = _within_reach(solution, u, settings)
            del solution, evidence
            iterations += figures["iterations"]
            products += figures["products"]
            projections += figures["projections"]
            if last:
                break
        coarsest = False
    measures = {
        "iterations": iterations,
        "products": products,
        "projections": projections,
        "residual": figures["residual"],
        "unexplained": unexplained,
        "trust": motion.trust,
        "thinning": 1 - (1 - motion.thinning) ** (4 / 3) if pair.compressed else motion.thinning,
    }
    return _Found(u, measures, confidence, source, left)


def _worthwhile(
    finest: Level, prediction: Prediction | None, search: bool, noise: float, settings: VelocitySettings
) -> Linearisation | None:
    """The change around the prediction, if that as it stands explains it well enough, and better than no motion."""
    if prediction is None or not any(component.any() for component in prediction.faces):
        return None
    u = prediction.displacement()
    linear = linearise(finest, u, search, settings)
    if linear is None:
        return None
    share, rest = _unexplained(linear, u, noise, settings)
    if share >= WORTHLESS:
        return None
    # The linearised change grows with the prediction, however wrong that is, so that long runs would run away.
    change = (finest.after - finest.before) / np.float32(linear.scale)
    return linear if rest < float(np.sum(linear.weight * change**2, dtype=np.float64)) else None


def _fit(
    level: Level, prediction: Prediction | None, linear: Linearisation, share: float, settings: VelocitySettings
) -> Motion:
    """Trust and momentum on one grid."""
    return fit_motion(
        prediction,
        level.after,
        linear.direction,
        linear.offset,
        linear.carried,
        linear.weight,
        share,
        closed_flags(settings.closed),
        settings.threads,
    )


def _thinned(linear: Linearisation, thinning: float) -> Linearisation:
    """The change that is left where a share of the smoke dissolves."""
    return replace(linear, offset=linear.offset + np.float32(thinning) * linear.carried) if thinning else linear


def _unexplained(linear: Linearisation, centre: Faces, noise: float, settings: VelocitySettings) -> tuple[float, float]:
    """What a velocity leaves of the squared change: the share beyond what noise of a variance accounts for, and all."""
    whole, rest, inside = _core.evidence(
        linear.direction, linear.offset, linear.weight, linear.smoke, centre, settings.threads
    )
    floor = noise / linear.scale**2 * inside
    return (max(rest - floor, 0.0) / (whole - floor) if whole > floor else 1.0), rest


def _source(
    level: Level, u: Faces, weight: Array, settings: VelocitySettings, compressed: bool
) -> tuple[Array, Unexplained]:
    """Density that enters in a frame, that is what is left unexplained where changes are not motion; and all of it."""
    carried, after = _core.advect_cells(level.before, u, False, True, settings.threads), level.after
    left = left_unexplained(after - carried, np.maximum(after, carried), 1.0, level.past, settings.threads)
    if compressed:
        carried, after = expanded(carried), expanded(after)
    source: Array = (1 - weight) * np.maximum(after - carried, 0)
    return source, left


def _confidence(direction: Faces, weight: Array, stiffness: float, settings: VelocitySettings) -> Array:
    """How much the images show beside what the regulariser adds, from 0 to 1."""
    shown = direction[0] ** 2
    for g in direction[1:]:
        shown += g**2
    shown *= weight
    shown = _core.blur(shown, CONFIDENCE_WIDTH, 3.0, settings.threads)
    confidence: Array = shown / (shown + np.float32(stiffness * settings.smoothness))
    return confidence


def _step(solution: Faces, u: Faces, smoke: npt.NDArray[np.bool_]) -> float:
    """Root mean square of what a solve changed, in voxels, on the low faces of voxels with smoke."""
    nx, ny, nz = smoke.shape
    squares = sum(np.square((new - old)[:nx, :ny, :nz][smoke]).mean() for new, old in zip(solution, u, strict=True))
    return float(np.sqrt(squares))


def _within_reach(solution: Faces, u: Faces, settings: VelocitySettings) -> Faces:
    """The solution, with increments cut to what the linearisation around `u` can know.

    Beyond that the data term says nothing, and thin or noisy smoke would throw single wisps many voxels far.
    """
    x, y, z = _core.within_reach(solution, u, REACH, closed_flags(settings.closed), settings.threads)
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
