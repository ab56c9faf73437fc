"""Single calls of the density fit and of the velocity, where a whole run would say no more."""

from dataclasses import replace

import numpy as np

from benchmarks.disturbances.known import GRID, Known
from benchmarks.disturbances.spoiled import FIRST, taken
from benchmarks.disturbances.whole_run import seen_in, smooth
from benchmarks.filming import filmed
from benchmarks.measure import Figures, view_figures
from smokelift.baselines.paper_method import PaperVelocity
from smokelift.density import ViewSet
from smokelift.evaluation.metrics import velocity_error
from smokelift.evaluation.truth import SMOKE_FRACTION, resampled
from smokelift.pipeline import Method, compose
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.settings import MethodName
from smokelift.transport import Velocity, advect, on_faces, project
from smokelift.velocity import DensityPair


def motion(known: Known, voxels: float, method: MethodName) -> Figures:
    """A density and the same one carried by its true flow, scaled to a mean way of so many voxels."""
    density = known.density(FIRST)
    smoke = density > SMOKE_FRACTION * density.max()
    flow = project(Velocity(on_faces(known.velocities[FIRST]), known.domain.voxel_size))
    way = np.linalg.norm(flow.centres()[smoke], axis=-1).mean() / (known.fps * flow.voxel_size)
    flow = flow.with_faces(np.float32(voxels / way) * component for component in flow.faces)
    after = advect(density, flow, 1 / known.fps)
    pair = DensityPair(density, after, 1 / known.fps, flow.voxel_size)
    found = compose(smooth(method)).velocity_estimator.estimate(pair)
    compared = after > SMOKE_FRACTION * after.max()
    return {"velocity_error": velocity_error(found.centres(), flow.centres(), compared)[0]}


def scaled_density(known: Known, factor: float, method: MethodName) -> Figures:
    """Two true densities, both times a factor: the motion between them is the same.

    The weights of the paper's estimate have the unit of a density squared. `PaperVelocity` takes them without a unit,
    so the paper's own are made of them here, such that both agree where the factor is 1.
    """
    before, after = (np.float32(factor) * known.density(moment) for moment in (FIRST, FIRST + 1))
    estimator = compose(smooth(method)).velocity_estimator
    if isinstance(estimator, PaperVelocity):
        smoothness, kinetic = (weight / factor**2 for weight in (estimator.smoothness, estimator.kinetic))
        estimator = replace(estimator, smoothness=smoothness, kinetic=kinetic)
    found = estimator.estimate(DensityPair(before, after, 1 / known.fps, known.domain.voxel_size))
    compared = (after > SMOKE_FRACTION * after.max()) & ~known.inlets[FIRST + 1]
    return {"velocity_error": velocity_error(found.centres(), known.velocities[FIRST + 1], compared)[0]}


def wrong_start(known: Known, factor: float, method: MethodName) -> Figures:
    """The fit of one frame, started from the true density times a factor."""
    take = taken(known.at([FIRST]))
    shot = prepare_shot(filmed(take.pictures), take.given, smooth(method))
    composed: Method = compose(shot.settings)
    views = ViewSet.of(shot.observe(0), shot.optics, 0)
    depth = composed.depth_prior.of_clip(shot).estimate(views)
    start = np.float32(factor) * resampled(known.densities[FIRST], GRID)
    density = composed.density_fit.fit(views, depth, start).density
    return view_figures(shot.scene, lambda _: density, known.cameras, seen_in(take), [0])
