"""The paper's method but for its renderer: the parts of algorithms 3 to 5, for comparison.

Density, algorithm 3: gradient descent with a fixed rate, the video used again as if from 90 degrees.

    rho <- max(0, rho - rate * densityGrad),   densityGrad = sum_views sum_pixels 2 (L - I) gradRec

Picture and record are the paper's own too (`smokelift.baselines.paper_renderer`). So are the fixed rate, the start from
thin fog, and the imposed side view where no other is given. Two slips of the listing are mended: the sign of the
difference, which ascends as printed, and the missing rho >= 0. One thing is added: the best density seen is kept. The
paper's derivative is none voxel by voxel, so in thick smoke the loss falls at first and then rises without bound, at
any rate.

Velocity, algorithm 5: one grid, one linearization around rest, first-order smoothness, primal-dual. It minimizes, over
velocities u without divergence in voxels per frame (equations 11 to 13),

    sum (after - before + g . u)^2 / s^2 + smoothness * sum |grad u|^2 + kinetic * sum |u|^2

with g and s as in `smokelift.velocity`. Source: Cen, Zhang, Liang (2023), Entropy 25, 1348, section 3.3.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from smokelift.density import DepthEstimate, FittedDensity, ObservedClip, Start, ViewSet, empty_density
from smokelift.density.fit import fit_figures, without_traces
from smokelift.density.hull import project_voxels
from smokelift.render import DeviceError, Image, Volume, device
from smokelift.scene import orbit
from smokelift.transport import StaggeredGrid, Velocity
from smokelift.velocity.estimator import DensityPair, in_meters, motion_weight, predict_velocity
from smokelift.velocity.linearization import blurred, least_squares, linearize
from smokelift.velocity.optical_flow import PicturePair
from smokelift.velocity.solver import PrimalDual, Solver

if TYPE_CHECKING:
    from smokelift.baselines.paper_renderer import PaperRenderer

FOG_DEPTH = 0.1
"""Optical depth across the domain of the fog that the fit starts from: thin, since dense media have local minima."""


@dataclass(frozen=True)
class OrthogonalCopy:
    """The paper's depth prior: thin fog, and a single picture imposed again as if from 90 degrees."""

    def of_clip(self, clip: ObservedClip) -> "OrthogonalCopy":
        """Itself: it does not read the clip."""
        return self

    def estimate(self, views: ViewSet) -> DepthEstimate:
        """Fog everywhere, and the imposed side view if there is only one view."""
        domain = views.optics.domain
        thin = FOG_DEPTH / (views.optics.medium.extinction * (domain.max[0] - domain.min[0]))
        fog = np.full(domain.resolution, thin, np.float32)
        inside = tuple(np.ones(view.mask.shape, np.float32) for view in views.views)
        if len(views.views) > 1:
            return DepthEstimate(fog, inside, views)
        front = views.views[0]
        camera = orbit(front.camera, domain, 90)
        side = replace(front, camera=camera, projection=project_voxels(camera, domain))
        return DepthEstimate(fog, inside, replace(views, views=(front, side)))


@dataclass(frozen=True)
class FixedRateDescent:
    """The paper's density fit; DeviceError if Taichi, which its renderer runs on, is not installed."""

    rate: float = 0.03
    """Change of density by one step in the steepest voxel of the prior's fog. The paper gives no figure
    (docs/experiments/density-descent.md)."""
    iterations: int = 60
    """Largest number of steps."""
    least_loss: float = 1e-4
    """Mean squared difference, over the pictures' mean square, at which to stop."""

    def __post_init__(self) -> None:
        """Check for Taichi before anything is done."""
        if not device.has_taichi():
            raise DeviceError(f"The paper's method cannot run, as {device.NO_TAICHI}.")

    def fit(self, views: ViewSet, depth: DepthEstimate, initial: Volume | None) -> FittedDensity:
        """Find a density anywhere in the domain; see `smokelift.density.DensityFit`."""
        from smokelift.baselines.paper_renderer import PaperRenderer  # here, because Taichi takes long to import

        if not views.hull.any():
            return empty_density(views)
        seen = depth.views.views
        renderers = [PaperRenderer(views.optics, view.camera, view.background[..., :3]) for view in seen]
        pictures = [view.image[..., :3] for view in seen]
        start = depth.density if initial is None else initial
        density, residuals, done = self._descend(renderers, pictures, start, depth.density)
        everywhere = tuple(replace(view, influenced=np.ones(view.mask.shape, np.bool_)) for view in views.views)
        judged = replace(views, views=everywhere, hull=np.ones_like(views.hull))
        return FittedDensity(without_traces(density, judged.where), judged.hull, fit_figures(judged, residuals, done))

    def _descend(
        self, renderers: "Sequence[PaperRenderer]", pictures: Sequence[Image], density: Volume, thin: Volume
    ) -> tuple[Volume, list[Image], int]:
        """The best density seen, its residuals, and the number of steps."""
        _, slope = _residuals_and_gradient(renderers, pictures, thin)
        factor = np.float32(self.rate / (float(np.abs(slope).max()) or 1.0))
        enough = self.least_loss * _squares(pictures)
        least, done = math.inf, 0
        while True:
            residuals, gradient = _residuals_and_gradient(renderers, pictures, density)
            loss = _squares(residuals)
            if loss < least:
                best, left, least = density, residuals, loss
            if loss <= enough or done >= self.iterations:
                return best, left, done
            density, done = np.maximum(density - factor * gradient, 0), done + 1


@dataclass(frozen=True)
class AllCarried:
    """The paper's temporal prior: each fit starts from the carried density as it is."""

    def start(self, depth: DepthEstimate, carried: Volume, smooth: Volume) -> Start:
        """The carried density; see `smokelift.density.TemporalPrior`."""
        return Start(carried, {})


@dataclass(frozen=True)
class PaperVelocity:
    """The paper's estimator (a `VelocityEstimator`), by the paper's splitting; see the module."""

    smoothness: float = 0.03
    kinetic: float = 0.003
    """Weights, without unit, of the squared differences of velocity and of the squared velocity. The latter only
    decides what nothing else does."""
    blur: float = 0.5
    """Standard deviation in voxels of the Gaussian that smooths the densities."""
    solver: Solver = field(default_factory=PrimalDual)

    def estimate(
        self, pair: DensityPair, prediction: Velocity | None = None, pictures: PicturePair | None = None
    ) -> Velocity:
        """Estimate as by `smokelift.velocity.estimate_velocity`; neither prediction nor pictures are used."""
        rest = StaggeredGrid.zero(pair.before.shape, 1.0, pair.closed)
        before, after = (blurred(density, self.blur) for density in (pair.before, pair.after))
        linear = linearize(before, after, motion_weight(rest.shape, pair.inflow), rest)
        if linear is None:
            return Velocity.zero(rest.shape, pair.voxel_size, pair.closed)
        problem = least_squares(linear, rest, first_order=self.smoothness, kinetic=self.kinetic)
        u, figures = self.solver.solve(problem, rest)
        measures = {name: figures[name] for name in ("iterations", "products", "projections", "residual")}
        return in_meters(u, pair, measures)

    def predict(self, velocity: Velocity, dt: float) -> Velocity:
        """The velocity of the next frame if no force acts."""
        return predict_velocity(velocity, dt)


def _squares(images: Sequence[Image]) -> float:
    return sum(float(np.sum(np.square(image, dtype=np.float64))) for image in images)


def _residuals_and_gradient(
    renderers: "Sequence[PaperRenderer]", pictures: Sequence[Image], density: Volume
) -> tuple[list[Image], Volume]:
    residuals, gradient = [], np.zeros_like(density)
    for renderer, picture in zip(renderers, pictures, strict=True):
        residuals.append(renderer.image(density) - picture)
        gradient += renderer.gradient(2 * residuals[-1])
    return residuals, gradient
