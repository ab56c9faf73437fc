"""The default estimator: from coarse to fine grids, linearised anew after every solve."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

import smokelift._core as _core
from smokelift.scene import Side
from smokelift.transport import Array, Faces, ResidualMeans, StaggeredGrid, Velocity, advect_cells
from smokelift.velocity.estimator import (
    Density,
    Estimate,
    Mask,
    checked,
    coarsened,
    motion_weight,
    predict_velocity,
)
from smokelift.velocity.linearisation import Linearisation, Regularisation, least_squares, linearise
from smokelift.velocity.momentum import Centre, Prediction, fit_centre
from smokelift.velocity.preparation import PreparedPair, prepare
from smokelift.velocity.pyramid import Level, coarsen, pyramid, refine, smoothed
from smokelift.velocity.settings import VelocitySettings
from smokelift.velocity.sources import SourceDetection

CONFIDENCE_WIDTH = 2.0
"""Standard deviation in voxels over which gradients count: smoothness carries what they show about as far."""


@dataclass(frozen=True)
class CoarseToFine:
    """The default estimator (a `VelocityEstimator`); see `smokelift.velocity` for the function that it minimises."""

    settings: VelocitySettings = field(default_factory=VelocitySettings)

    def estimate(
        self,
        before: Density,
        after: Density,
        dt: float,
        voxel_size: float,
        *,
        closed: tuple[Side, ...] = (),
        inflow: Mask | None = None,
        prediction: Velocity | None = None,
    ) -> Velocity:
        """See `smokelift.velocity.estimate_velocity`."""
        settings = self.settings
        # a prediction may be on the coarser grid already, where its shape is checked
        first, second = checked(before, after, dt, voxel_size, inflow, None if settings.coarsening else prediction)
        rest = Velocity.zero(first.shape, voxel_size, closed)
        peaks = sorted(float(density.max()) for density in (first, second))
        if peaks[0] <= settings.smoke_threshold * peaks[1]:
            # Between smoke and none there is no motion to be seen: what is new has come in.
            source = np.maximum(second - first, 0) / np.float32(dt)
            return replace(rest, confidence=np.zeros_like(second), source=source)
        if settings.coarsening:
            coarser = CoarseToFine(replace(settings, coarsening=settings.coarsening - 1))
            found = coarser.estimate(
                coarsen(first),
                coarsen(second),
                dt,
                2 * voxel_size,
                closed=closed,
                inflow=None if inflow is None else coarsen(inflow.astype(np.float32)) > 0,
                prediction=coarsened(prediction) if prediction and prediction.shape == first.shape else prediction,
            )
            return found if coarser.settings.coarsening else smoothed(found)
        weight = motion_weight(first.shape, inflow)
        pair = prepare(first, second, settings)
        finest = Level(pair.before, pair.after, weight, past=None if prediction is None else prediction.residual)
        predicted = None if prediction is None else Prediction(replace(prediction, closed=rest.closed), dt)
        sources = settings.sources if inflow is None else None
        estimate = _estimate(finest, predicted, sources, pair, rest.closed, settings)
        return rest if estimate is None else estimate.velocity(dt, voxel_size)

    def predict(self, velocity: Velocity, dt: float) -> Velocity:
        """The velocity of the next frame if no force acts, carried along on its grid."""
        predicted = predict_velocity(velocity, dt)
        return smoothed(predicted) if self.settings.coarsening else predicted


def _estimate(
    finest: Level,
    prediction: Prediction | None,
    sources: SourceDetection | None,
    pair: PreparedPair,
    closed: tuple[Side, ...],
    settings: VelocitySettings,
) -> Estimate | None:
    """From coarse to fine, or on the finest grid alone where a prediction is good enough to start from."""
    first = _around_prediction(finest, prediction, sources, pair.noise, settings)
    guided = first is not None
    if not guided:
        prediction, finest = None, replace(finest, past=None)
    levels = [finest] if guided else pyramid(finest, settings.grids)
    share = 1.0 if guided else settings.momentum
    effort: Counter[str] = Counter(iterations=0, products=0, projections=0)
    centre: Centre
    u = StaggeredGrid.zero(levels[0].after.shape, 1.0, closed) if prediction is None else prediction.displacement()
    coarsest = levels[0].coarseness
    on_finest = 1 if finest.after.size > settings.large_grid else settings.linearisations
    while levels:  # a grid is not kept after its turn
        level = levels.pop(0)
        if level.coarseness < coarsest:
            u = refine(u, level.after.shape)
        count = on_finest if level is finest else settings.linearisations
        for number in range(count):
            # around rest all of the change would be a source
            from_rest = not guided and number == 0 and level.coarseness == coarsest
            searched = None if from_rest else sources
            linear, first = first or linearise(level, u, settings.smoke_threshold, searched), None
            if linear is None:
                return None
            if from_rest and sources is not None and not pair.noisy and number < count - 1:
                first_weight = sources.first_weight(linear.direction, linear.offset, linear.smoke)
                linear = replace(linear, weight=linear.weight * first_weight)
            if level.coarseness == coarsest or level is not finest:
                centre = fit_centre(prediction, level.after, linear, u, share, settings.brightening)
            elif number == 0:  # twelve projections are too much for the finest grid
                centre = centre.refined()
            around = centre.velocity(prediction, level.after, u)
            linear = linear.with_dissipation(centre.dissipation)
            unexplained, _ = linear.unexplained(around, pair.noise / level.coarseness**3)
            terms = _regularisation(unexplained, settings)
            problem, start = least_squares(linear, around, terms), around if from_rest else u
            direction, weight, smoke = linear.direction, linear.weight, linear.smoke
            # The solver takes most of the memory: free the linearisation before it, and the problem after it.
            del linear, around
            solution, figures = settings.solver.solve(problem, start)
            del problem, start
            last = number == count - 1 or (guided and _step(solution, u, smoke) < settings.small_step)
            if level is finest and last:
                source, residual = _source(level, u, weight, settings, pair)
                confidence = _confidence(direction, weight, terms.second_order)
            u = _clamped(solution, u, settings.largest_increment)
            del solution, direction, weight
            effort.update({name: figures[name] for name in ("iterations", "products", "projections")})
            if last:
                break
    measures = {
        **effort,
        "residual": figures["residual"],
        "unexplained": unexplained,
        "trust": centre.trust,
        "dissipation": pair.density_dissipation(centre.dissipation),
    }
    return Estimate(u, measures, confidence, source, residual)


def _around_prediction(
    finest: Level,
    prediction: Prediction | None,
    sources: SourceDetection | None,
    noise: float,
    settings: VelocitySettings,
) -> Linearisation | None:
    """The change around the prediction, if that as it stands explains it well enough, and better than no motion."""
    if prediction is None or not any(component.any() for component in prediction.velocity.faces):
        return None
    u = prediction.displacement()
    linear = linearise(finest, u, settings.smoke_threshold, sources)
    if linear is None:
        return None
    share, rest = linear.unexplained(u, noise)
    if share >= settings.worthless:
        return None
    # The linearised change grows with the prediction, however wrong that is, so that long runs would run away.
    change = (finest.after - finest.before) / np.float32(linear.scale)
    return linear if rest < float(np.sum(linear.weight * change**2, dtype=np.float64)) else None


def _regularisation(unexplained: float, settings: VelocitySettings) -> Regularisation:
    """The weights for a centre that leaves a share of the change unexplained: the less, the stiffer."""
    stiffness = settings.unexplained / max(unexplained, settings.least_unexplained)
    return Regularisation(
        second_order=stiffness * settings.smoothness,
        kinetic=stiffness * settings.kinetic,
        irrotational=settings.irrotational,
    )


def _source(
    level: Level, u: StaggeredGrid, weight: Array, settings: VelocitySettings, pair: PreparedPair
) -> tuple[Array, ResidualMeans]:
    """Density that enters in a frame, that is what is left unexplained where changes are not motion; and all of it."""
    carried, after = advect_cells(level.before, u), level.after
    detection = settings.sources or SourceDetection()
    residual = detection.means(after - carried, np.maximum(after, carried), 1.0, level.past)
    source: Array = (1 - weight) * np.maximum(pair.density(after) - pair.density(carried), 0)
    return source, residual


def _confidence(direction: Faces, weight: Array, smoothness: float) -> Array:
    """How much the densities show beside what the regulariser adds, from 0 to 1."""
    shown = direction[0] ** 2
    for g in direction[1:]:
        shown += g**2
    shown *= weight
    shown = _core.blur(shown, CONFIDENCE_WIDTH, 3.0)
    confidence: Array = shown / (shown + np.float32(smoothness))
    return confidence


def _step(solution: StaggeredGrid, u: StaggeredGrid, smoke: npt.NDArray[np.bool_]) -> float:
    """Root mean square of what a solve changed, in voxels, on the low faces of voxels with smoke."""
    nx, ny, nz = smoke.shape
    pairs = zip(solution.faces, u.faces, strict=True)
    return float(np.sqrt(sum(np.square((new - old)[:nx, :ny, :nz][smoke]).mean() for new, old in pairs)))


def _clamped(solution: StaggeredGrid, u: StaggeredGrid, largest: float) -> StaggeredGrid:
    """The solution, with increments cut to what the linearisation around `u` can know.

    Beyond that the data term says nothing, and thin or noisy smoke would throw single wisps many voxels far.
    """
    return u.with_faces(_core.clamp_increment(solution.faces, u.faces, largest, u.walls))
