"""The default estimator: on one coarse grid in a reconstruction, else coarse to fine."""

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from smokelift.checks import require_kind
from smokelift.scene.checks import integer
from smokelift.transport import Array, StaggeredGrid, Velocity, require_same_shape, without_divergence
from smokelift.velocity.estimator import DensityPair, in_meters, motion_weight, predict_velocity
from smokelift.velocity.linearization import (
    SMOKE_THRESHOLD,
    PreparedPair,
    fit_center,
    least_squares,
    linearize,
    prepare,
)
from smokelift.velocity.optical_flow import PicturePair, correct_by_optical_flow
from smokelift.velocity.pyramid import coarsen_density, coarsen_velocity, default_coarsening, refine, smooth_velocity
from smokelift.velocity.solver import ProjectedCG, Solver

ONE_VIEW_SMOOTHNESS = 10.0
"""Factor on `smoothness` for densities of one view. What moves is mixed along its rays, and a depth that is assumed
anew in every frame moves as well (docs/experiments/velocity-one-view.md)."""

IRROTATIONAL = 0.05
"""Weight of vorticity where there is no smoke that could show it (docs/experiments/velocity-solver.md)."""

KINETIC = 0.003
"""Weight of what departs from the center. It only holds what nothing else does
(docs/experiments/velocity-solver.md)."""

UNEXPLAINED_FRACTION, MIN_UNEXPLAINED_FRACTION = 0.25, 0.04
"""Fraction of the change, left unexplained by the center, at which the weights apply unscaled: they grow in inverse
proportion to that fraction, down to the second one (docs/experiments/velocity-solver.md)."""

MAX_UNEXPLAINED_FRACTION = 0.5
"""Fraction of the change left unexplained from which a prediction is not used: after a cut, say, or a gust
(docs/experiments/velocity-solver.md)."""

MAX_INCREMENT = 1.0
"""Voxels of the grid at hand. A linearization of the density holds no further, so the increment is clamped
(docs/experiments/velocity-solver.md)."""


@dataclass(frozen=True)
class VelocitySettings:
    """How the default estimator finds a velocity. Weights have no unit: see the formula in `smokelift.velocity`.

    Defaults are chosen on baked scenes (plumes, jets, two sources, puffs); `benchmarks/truth` says which scenes choose
    and which only report. docs/experiments has the sweeps, under the names given here.

    Attributes
    ----------
    coarsening
        How many times the grid of the estimate is halved. The velocity is interpolated to the densities' grid. None is
        the densities' own grid, but in a clip whose open choices are measured (`Settings.measure`) one of at most 30
        voxels along the longest side.
    linearizations
        Linearizations on each grid (docs/experiments/velocity-solver.md).
    smoothness
        Weight of the differences of vorticity.
    solver
        `ProjectedCG`, or `PrimalDual`, which has the same minimum at several times the cost (velocity-solver.md).
    """

    coarsening: int | None = None
    linearizations: int = 2
    smoothness: float = 0.03
    solver: Solver = field(default_factory=ProjectedCG)

    def __post_init__(self) -> None:
        """Check the counts; ValueError."""
        integer(self.linearizations, "linearizations", "a whole number from 1", least=1)
        if self.coarsening is not None:
            integer(self.coarsening, "coarsening", "a whole number from 0, or None", least=0)


@dataclass(frozen=True)
class CoarseToFine:
    """The default estimator (a `VelocityEstimator`); `smokelift.velocity` has the function that it minimizes."""

    settings: VelocitySettings = field(default_factory=VelocitySettings)

    def estimate(
        self, pair: DensityPair, prediction: Velocity | None = None, pictures: PicturePair | None = None
    ) -> Velocity:
        """See `smokelift.velocity.estimate_velocity`; with pictures it is smoother, and corrected by optical flow."""
        settings = self.settings
        if pictures is not None:
            settings = replace(settings, smoothness=ONE_VIEW_SMOOTHNESS * settings.smoothness)
        require_kind(prediction, Velocity | None, "prediction", "a Velocity")
        peaks = sorted((float(pair.before.max()), float(pair.after.max())))
        seen = peaks[0] > SMOKE_THRESHOLD * peaks[1]  # between smoke and none there is no motion to be seen
        for _ in range(settings.coarsening or 0):
            if prediction is not None and prediction.shape == pair.before.shape:
                prediction = coarsen_velocity(prediction)
            pair = _half(pair)
        if prediction is not None:
            require_same_shape("the prediction", prediction.shape, pair.before.shape)
        found = _velocity_on_grid(pair, prediction, settings) if seen else None
        if found is None:
            found = Velocity.zero(pair.before.shape, pair.voxel_size, pair.closed)
        elif settings.coarsening:
            found = smooth_velocity(found)
        return found if pictures is None else correct_by_optical_flow(found, pictures, pair.after, pair.dt)

    def predict(self, velocity: Velocity, dt: float) -> Velocity:
        """The velocity of the next frame if no force acts, carried along on its own grid."""
        predicted = predict_velocity(velocity, dt)
        return smooth_velocity(predicted) if self.settings.coarsening else predicted


def _velocity_on_grid(pair: DensityPair, given: Velocity | None, settings: VelocitySettings) -> Velocity | None:
    """The velocity on the pair's grid; None where there is no structure to follow.

    Without a usable prediction it starts from that of a grid half as fine, unless the pair's grid is coarse.
    """
    x, y, z = shape = pair.before.shape
    prepared, weight = prepare(pair.before, pair.after), motion_weight(shape, pair.inflow)
    start = prediction = _usable_prediction(given, pair, prepared, weight)
    if start is None and default_coarsening((x, y, z)):
        coarse = _velocity_on_grid(_half(pair), None, settings)
        start = None if coarse is None else refine(coarse, (x, y, z)).displacement(pair.dt)
    u = StaggeredGrid.zero(shape, 1.0, pair.closed) if start is None else start
    effort: Counter[str] = Counter()
    for _ in range(settings.linearizations):
        linear = linearize(prepared.before, prepared.after, weight, u)
        if linear is None:
            return None
        center, trust, dissipation = fit_center(prediction, prepared.after, linear, u)
        linear = linear.with_dissipation(dissipation)
        fraction, _ = linear.unexplained_fraction(center, prepared.noise)
        scale = UNEXPLAINED_FRACTION / max(fraction, MIN_UNEXPLAINED_FRACTION)
        smoothness, kinetic = scale * settings.smoothness, scale * KINETIC
        problem = least_squares(linear, center, second_order=smoothness, kinetic=kinetic, irrotational=IRROTATIONAL)
        start = u if any(component.any() for component in u.faces) else center
        del linear  # the solver takes most of the memory
        solution, solved = settings.solver.solve(problem, start)
        effort.update({name: solved[name] for name in ("iterations", "products", "projections")})
        u = _clamped(solution, u)
    found = {"residual": solved["residual"], "unexplained": fraction, "trust": trust}
    return in_meters(u, pair, {**effort, **found, "dissipation": prepared.density_dissipation(dissipation)})


def _half(pair: DensityPair) -> DensityPair:
    inflow = None if pair.inflow is None else coarsen_density(pair.inflow.astype(np.float32)) > 0
    before, after = coarsen_density(pair.before), coarsen_density(pair.after)
    return replace(pair, before=before, after=after, voxel_size=2 * pair.voxel_size, inflow=inflow)


def _usable_prediction(
    given: Velocity | None, pair: DensityPair, prepared: PreparedPair, weight: Array
) -> StaggeredGrid | None:
    """The prediction in voxels per frame, if it explains the change well enough as it is, and better than no motion."""
    if given is None or not any(component.any() for component in given.faces):
        return None
    u = replace(given, closed=pair.closed).displacement(pair.dt)
    linear = linearize(prepared.before, prepared.after, weight, u)
    if linear is None:
        return None
    fraction, rest = linear.unexplained_fraction(u, prepared.noise)
    # The linearized change grows with the prediction, however wrong that is, so that long runs would run away.
    change = (prepared.after - prepared.before) / np.float32(linear.scale)
    usable = fraction < MAX_UNEXPLAINED_FRACTION and rest < float(np.sum(linear.weight * change**2, dtype=np.float64))
    return u if usable else None


def _clamped(solution: StaggeredGrid, u: StaggeredGrid) -> StaggeredGrid:
    """The solution, no component further than `MAX_INCREMENT` from u, without divergence.

    Else thin or noisy smoke would throw single wisps many voxels far.
    """
    increments = [found - before for found, before in zip(solution.faces, u.faces, strict=True)]
    if all(np.abs(increment).max() <= MAX_INCREMENT for increment in increments):
        return solution
    clamped = u.with_faces(
        before + np.clip(increment, -MAX_INCREMENT, MAX_INCREMENT)
        for before, increment in zip(u.faces, increments, strict=True)
    )
    return without_divergence(clamped)[0]
