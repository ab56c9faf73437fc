"""The default estimator: from coarse to fine grids, linearised anew after every solve."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

import smokelift._core as _core
from smokelift.scene import Side
from smokelift.scene.domain import checked_sides
from smokelift.transport import (
    Array,
    Faces,
    ResidualMeans,
    StaggeredGrid,
    Velocity,
    advect_cells,
)
from smokelift.velocity.estimator import VelocityEstimate, checked, coarsened, motion_weight, predict_velocity
from smokelift.velocity.linearisation import Linearisation, Regularisation, least_squares, linearise
from smokelift.velocity.momentum import Centre, Prediction, fit_centre
from smokelift.velocity.pair import DensityPair
from smokelift.velocity.preparation import PreparedPair, prepare
from smokelift.velocity.pyramid import Level, coarsen, pyramid, refine, smoothed
from smokelift.velocity.settings import VelocitySettings
from smokelift.velocity.source_detection import SourceDetection

ONE_VIEW_SMOOTHNESS = 10.0
"""Factor on `smoothness` for densities of one view. What moves is mixed along its rays, and a depth that is assumed
anew in every frame moves as well (docs/experiments/velocity-one-view.md)."""

CONFIDENCE_WIDTH = 2.0
"""Standard deviation (voxels) over which gradients count: smoothness carries what they show about as far."""


@dataclass(frozen=True)
class CoarseToFine:
    """The default estimator (a `VelocityEstimator`); `smokelift.velocity` has the function that it minimises."""

    settings: VelocitySettings = field(default_factory=VelocitySettings)

    def estimate(self, pair: DensityPair, prediction: Velocity | None = None) -> Velocity:
        """See `smokelift.velocity.estimate_velocity`."""
        settings = self.settings
        # a prediction may be on the coarser grid already, where its shape is checked
        first, second = checked(pair, None if settings.coarsening else prediction)
        closed = checked_sides(pair.closed)
        peaks = sorted(float(density.max()) for density in (first, second))
        if peaks[0] <= settings.smoke_threshold * peaks[1]:
            # Between smoke and none there is no motion to be seen: what is new has come in.
            source = np.maximum(second - first, 0) / np.float32(pair.dt)
            rest = Velocity.zero(first.shape, pair.voxel_size, closed)
            return replace(rest, confidence=np.zeros_like(second), source=source)
        if settings.coarsening:
            coarser = CoarseToFine(replace(settings, coarsening=settings.coarsening - 1))
            if prediction and prediction.shape == first.shape:
                prediction = coarsened(prediction)
            inflow = None if pair.inflow is None else coarsen(pair.inflow.astype(np.float32)) > 0
            half = DensityPair(coarsen(first), coarsen(second), pair.dt, 2 * pair.voxel_size, closed, inflow)
            found = coarser.estimate(half, prediction)
            return found if coarser.settings.coarsening else smoothed(found)
        weight = motion_weight(first.shape, pair.inflow)
        prepared = prepare(first, second, settings)
        past = None if prediction is None else prediction.residual
        finest = Level(prepared.before, prepared.after, weight, past=past)
        predicted = None if prediction is None else Prediction(replace(prediction, closed=closed), pair.dt)
        sources = settings.sources if pair.inflow is None else None
        estimate = _Estimation(finest, predicted, sources, prepared, closed, settings).result()
        if estimate is None:
            return Velocity.zero(first.shape, pair.voxel_size, closed)
        return estimate.velocity(pair.dt, pair.voxel_size)

    def predict(self, velocity: Velocity, dt: float) -> Velocity:
        """The velocity of the next frame if no force acts, carried along on its own grid."""
        predicted = predict_velocity(velocity, dt)
        return smoothed(predicted) if self.settings.coarsening else predicted

    def of_one_view(self) -> CoarseToFine:
        """The estimator with more smoothness."""
        return replace(self, settings=replace(self.settings, smoothness=ONE_VIEW_SMOOTHNESS * self.settings.smoothness))


class _Solved(NamedTuple):
    """What a solve found, and what of its problem is still needed.

    `u` is in voxels of its grid a frame, `smoothness` the weight of |grad curl v|^2; the rest is the `Linearisation`'s.
    """

    u: StaggeredGrid
    direction: Faces
    weight: Array
    smoke: npt.NDArray[np.bool_]
    smoothness: float


class _Estimation:
    """One estimate: from coarse to fine, or on the finest grid alone if a prediction is good enough to start from.

    ``finest`` are the densities, ``pair`` the same with what is known of their noise and contrast. Without ``sources``
    no smoke that enters is searched for.
    """

    def __init__(
        self,
        finest: Level,
        prediction: Prediction | None,
        sources: SourceDetection | None,
        pair: PreparedPair,
        closed: tuple[Side, ...],
        settings: VelocitySettings,
    ) -> None:
        self._sources, self._pair, self._settings = sources, pair, settings
        self._first = _around_prediction(finest, prediction, sources, pair.noise, settings)
        self._guided = self._first is not None
        self._prediction = prediction if self._guided else None
        self._finest = finest if self._guided else replace(finest, past=None)
        self._levels = [self._finest] if self._guided else pyramid(self._finest, settings.levels)
        self._coarsest = self._levels[0].coarseness
        if self._prediction is None:
            self._u = StaggeredGrid.zero(self._levels[0].after.shape, 1.0, closed)
        else:
            self._u = self._prediction.displacement()
        self._centre: Centre
        self._effort: Counter[str] = Counter(iterations=0, products=0, projections=0)
        self._figures: dict[str, float] = {}

    def result(self) -> VelocityEstimate | None:
        """The estimate; None where there is no structure to follow."""
        settings = self._settings
        while self._levels:  # a grid is not kept after its turn
            level = self._levels.pop(0)
            if level.coarseness < self._coarsest:
                self._u = refine(self._u, level.after.shape)
            count = self._linearisations(level)
            for number in range(count):
                solved = self._solve(level, number)
                if solved is None:
                    return None
                last = number == count - 1 or (
                    self._guided and _step(solved.u, self._u, solved.smoke) < settings.small_step
                )
                if level is self._finest and last:
                    source, residual = _source(level, self._u, solved.weight, settings, self._pair)
                    confidence = _confidence(solved.direction, solved.weight, solved.smoothness)
                self._u = _clamped(solved.u, self._u, settings.largest_increment)
                del solved  # the next linearisation needs the memory
                if last:
                    break
        return VelocityEstimate(self._u, {**self._effort, **self._figures}, confidence, source, residual)

    def _linearisations(self, level: Level) -> int:
        """Largest number of linearisations on a grid."""
        settings = self._settings
        large = level is self._finest and level.after.size > settings.large_grid
        return 1 if large else settings.linearisations

    def _solve(self, level: Level, number: int) -> _Solved | None:
        """Linearise for the time `number`, from 0, and solve; None where there is no structure to follow."""
        from_rest = not self._guided and number == 0 and level.coarseness == self._coarsest
        linear = self._linearised(level, from_rest)
        if linear is None:
            return None
        self._centre = self._fitted_centre(level, number, linear)
        around = self._centre.velocity(self._prediction, level.after, self._u)
        linear = linear.with_dissipation(self._centre.dissipation)
        unexplained, _ = linear.unexplained(around, self._pair.noise / level.coarseness**3)
        terms = _regularisation(unexplained, self._settings)
        problem, start = least_squares(linear, around, terms), around if from_rest else self._u
        direction, weight, smoke = linear.direction, linear.weight, linear.smoke
        # The solver takes most of the memory: free the linearisation before it.
        del linear, around
        solution, figures = self._settings.solver.solve(problem, start)
        self._effort.update({name: figures[name] for name in ("iterations", "products", "projections")})
        self._figures = {
            "residual": figures["residual"],
            "unexplained": unexplained,
            "trust": self._centre.trust,
            "dissipation": self._pair.density_dissipation(self._centre.dissipation),
        }
        return _Solved(solution, direction, weight, smoke, terms.second_order)

    def _linearised(self, level: Level, from_rest: bool) -> Linearisation | None:
        """The change around the velocity so far."""
        if self._first is not None:  # that around the prediction is known already
            first, self._first = self._first, None
            return first
        # around rest all of the change would be a source
        searched = None if from_rest else self._sources
        linear = linearise(level, self._u, self._settings.smoke_threshold, searched)
        again = self._linearisations(level) > 1
        if linear is None or not from_rest or self._sources is None or self._pair.noisy or not again:
            return linear
        first_weight = self._sources.first_weight(linear.direction, linear.offset, linear.smoke)
        return replace(linear, weight=linear.weight * first_weight)

    def _fitted_centre(self, level: Level, number: int, linear: Linearisation) -> Centre:
        """The motion that the velocity is regularised around."""
        settings = self._settings
        if level is self._finest and level.coarseness < self._coarsest:
            # twelve projections are too much for the finest grid
            return self._centre.refined() if number == 0 else self._centre
        share = 1.0 if self._guided else settings.momentum
        return fit_centre(self._prediction, level.after, linear, self._u, share, settings.brightening)


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
    """The weights around a centre: the less of the change it leaves unexplained, the stiffer."""
    stiffness = settings.unexplained / max(unexplained, settings.least_unexplained)
    return Regularisation(
        second_order=stiffness * settings.smoothness,
        kinetic=stiffness * settings.kinetic,
        irrotational=settings.irrotational,
    )


def _source(
    level: Level, u: StaggeredGrid, weight: Array, settings: VelocitySettings, pair: PreparedPair
) -> tuple[Array, ResidualMeans]:
    """Density that enters in a frame, unexplained and no motion; and the means of all that is unexplained."""
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
    """Root mean square change (voxels) that a solve made on the low faces of voxels with smoke."""
    nx, ny, nz = smoke.shape
    pairs = zip(solution.faces, u.faces, strict=True)
    return float(np.sqrt(sum(np.square((new - old)[:nx, :ny, :nz][smoke]).mean() for new, old in pairs)))


def _clamped(solution: StaggeredGrid, u: StaggeredGrid, largest: float) -> StaggeredGrid:
    """The solution, with increments cut to what the linearisation around `u` can know.

    Beyond that the data term says nothing: thin or noisy smoke would throw single wisps many voxels far.
    """
    return u.with_faces(_core.clamp_increment(solution.faces, u.faces, largest, u.walls))
