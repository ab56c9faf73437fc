"""The default method without one of its parts: compositions for experiments."""

from dataclasses import dataclass, replace

import numpy as np

from smokelift.density import (
    DensityFit,
    DepthEstimate,
    FittedDensity,
    GradientFit,
    NothingCarried,
    ObservedClip,
    ObservedView,
    RoundDepth,
    ViewSet,
)
from smokelift.density.upright_plane import view_frame
from smokelift.pipeline import Method
from smokelift.render import Volume
from smokelift.scene import Domain
from smokelift.transport import Velocity, advect
from smokelift.velocity import CoarseToFine


@dataclass(frozen=True)
class EvenDepth:
    """A depth prior: smoke is spread evenly along each ray through the domain."""

    def of_clip(self, clip: ObservedClip) -> "EvenDepth":
        """Return itself: it reads nothing of the clip."""
        return self

    def estimate(self, views: ViewSet) -> DepthEstimate:
        """Return the mean of the even densities of all views."""
        domain, hull = views.optics.domain, views.hull
        density = np.zeros(domain.resolution, np.float32)
        even = [view.projection.places(hull).read(view.optical_depth) / thickness(view, domain) for view in views.views]
        density[hull] = np.mean(even, axis=0) / views.optics.medium.extinction
        return DepthEstimate(density, tuple(np.ones_like(view.optical_depth) for view in views.views), views)


@dataclass(frozen=True)
class WithoutHull:
    """A density fit that may put smoke wherever a camera looks."""

    density_fit: DensityFit

    def fit(self, views: ViewSet, depth: DepthEstimate, initial: Volume | None) -> FittedDensity:
        """Fit within the cameras' frusta."""
        visible = np.any([view.projection.visible for view in views.views], axis=0)
        return self.density_fit.fit(views, replace(depth, views=replace(depth.views, hull=visible)), initial)


@dataclass(frozen=True)
class UnprojectedPrediction(CoarseToFine):
    """The default velocity estimator, but its prediction keeps its divergence."""

    def predict(self, velocity: Velocity, dt: float) -> Velocity:
        """Return the velocity carried along by itself."""
        return advect(velocity, velocity, dt)


def leave_out(part: str, method: Method) -> Method:
    """Return the default method without a part of it.

    - transport: every frame starts from its own pictures
    - hull: smoke may be wherever a camera looks
    - depth: the initial density is even along the rays, without detail (settings leave out the detail alone)
    - projection: the predicted velocity keeps its divergence
    - pictures: the velocity of one view is estimated as that of several, and no motion in the pictures corrects it

    Raises
    ------
    ValueError
        If there is no such part.
    """
    estimator = method.velocity_estimator
    if part == "transport":
        return replace(method, temporal_prior=NothingCarried())
    if part == "hull":
        return replace(method, density_fit=WithoutHull(method.density_fit))
    if part == "depth":
        return replace(method, depth_prior=EvenDepth())
    if part == "projection" and isinstance(estimator, CoarseToFine):
        return replace(method, velocity_estimator=UnprojectedPrediction(estimator.settings))
    if part == "pictures":
        return replace(method, optical_flow=False)
    parts = "transport, hull, depth, projection or pictures"
    raise ValueError(f"without={part}: expected {parts} of the default method.")


def smear(views: ViewSet, fit: GradientFit) -> Volume:
    """Return a density that is constant along the rays of one view; the fit must scale whole rays only."""
    optics = views.optics
    fog = 0.5 / (optics.medium.extinction * thickness(views.views[0], optics.domain))
    start = np.full(optics.domain.resolution, fog, np.float32)
    return fit.fit(views, RoundDepth().estimate(views), start).density


def thickness(view: ObservedView, domain: Domain) -> float:
    """Return how deep the domain is along a view (m)."""
    _, depth, _ = view_frame(view.camera)
    return float((np.array(domain.max) - domain.min) @ np.abs(depth))
