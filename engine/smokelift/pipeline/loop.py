"""The loop over frames, by the parts of a method (algorithms 1 and 4): a clip in, density and velocity of each out.

rho_1 and rho_2 are fitted to their pictures alone, and u_2 = VelRecon(rho_1, rho_2); then for t = 3, 4, ...
    u~_t   = Project(advect(u_t-1, u_t-1))          prediction of the velocity
    rho~_t = advect(rho_t-1, u~_t)                  prediction of the density
    rho_t  = Reconstruction(picture_t, rho~_t)      correction by the renderer
    u_t    = VelRecon(rho_t-1, rho_t, u~_t)         correction of the velocity
"""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from smokelift.baselines.paper_method import AllCarried, FixedRateDescent, OrthogonalCopy, PaperVelocity
from smokelift.checks import require_kind
from smokelift.density import (
    AdvectedDetail,
    DensityFit,
    DepthPrior,
    DetailedDepth,
    FittedDensity,
    GradientFit,
    NothingCarried,
    RoundDepth,
    TemporalPrior,
    ViewSet,
)
from smokelift.density.flame import flame_emission
from smokelift.density.hull import project_voxels
from smokelift.footage.images import Picture
from smokelift.output.archive import ResumeState
from smokelift.pipeline.clip_fit import clip_psnr
from smokelift.render import Volume
from smokelift.render.device import products_on_one_thread
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot
from smokelift.transport import Array, Velocity, halved
from smokelift.velocity import CoarseToFine, VelocityEstimator
from smokelift.velocity.estimator import DensityPair
from smokelift.velocity.optical_flow import PicturePair
from smokelift.velocity.pyramid import advect_near, refine_near_smoke


@dataclass(frozen=True)
class Method:
    """How a clip is reconstructed, part by part.

    Attributes
    ----------
    density_fit
        Finds a density that renders to the pictures.
    depth_prior
        What is assumed of the depth, which one picture leaves undetermined.
    velocity_estimator
        Finds the velocity between two densities, and predicts the next.
    temporal_prior
        What a frame takes over from the one before.
    optical_flow
        Whether the estimator gets the pictures, where one camera that stands still alone sees the smoke, to correct the
        velocity by the optical flow in them (`velocity.optical_flow`).
    """

    density_fit: DensityFit
    depth_prior: DepthPrior
    velocity_estimator: VelocityEstimator
    temporal_prior: TemporalPrior
    optical_flow: bool = True


def other_parts(method: Method, settings: Settings) -> dict[str, str | bool]:
    """The names of what stands for other parts in a method than the settings ask for, by part."""
    asked = _names(compose(settings))
    return {part: name for part, name in _names(method).items() if name != asked[part]}


def _names(method: Method) -> dict[str, str | bool]:
    return {part: of if isinstance(of, bool) else type(of).__name__ for part, of in vars(method).items()}


def compose(settings: Settings) -> Method:
    """The method that settings ask for."""
    require_kind(settings, Settings, "settings", "Settings (Settings.preset makes them)")
    if settings.method == "paper":
        return Method(FixedRateDescent(), OrthogonalCopy(), PaperVelocity(), AllCarried(), optical_flow=False)
    smooth = RoundDepth()
    return Method(
        density_fit=GradientFit(settings.density),
        depth_prior=DetailedDepth(smooth, settings.detail, settings.seed) if settings.detail > 0 else smooth,
        velocity_estimator=CoarseToFine(settings.velocity),
        temporal_prior=AdvectedDetail(settings.transport) if settings.transport > 0 else NothingCarried(),
    )


@dataclass(frozen=True, eq=False)
class CarriedState:
    """What the next frame needs of a frame.

    Attributes
    ----------
    number
        Of the frame, 1 for the clip's first.
    density : (nx, ny, nz) float32
    velocity
        In m/s, on the grid of its estimate, all over the domain.
    smooth_density : (nx, ny, nz) float32, optional
        The density without made-up detail, from which velocity is estimated; None if nothing was made up.
    for_advection : (nx, ny, nz) float32, optional
        What the next frame carries along, if not the density: see `smokelift.density.FittedDensity`.
    picture : (rows, columns), optional
        The picture from which optical flow to the next one is found; None where it is not used. It is not stored.
    """

    number: int
    density: Volume
    velocity: Velocity
    smooth_density: Volume | None = None
    for_advection: Volume | None = None
    picture: Picture | None = None

    def stored(self) -> ResumeState:
        """What a run that is resumed after the frame reads."""
        volumes = {"smooth": self.smooth_density, "steady": self.for_advection}
        present = {name: volume for name, volume in volumes.items() if volume is not None}
        return ResumeState(self.number, self.density, self.velocity.faces, present)

    @staticmethod
    def read(state: ResumeState, shot: Shot) -> "CarriedState":
        """The inverse of `stored`."""
        velocity = Velocity(state.velocity, shot.optics.domain.voxel_size, shot.scene.closed)
        shape = shot.optics.domain.resolution
        while shape != velocity.shape:
            shape, velocity = halved(shape), replace(velocity, voxel_size=2 * velocity.voxel_size)
        smooth, for_advection = (state.extra.get(name) for name in ("smooth", "steady"))
        return CarriedState(state.number, state.density, velocity, smooth, for_advection)


@dataclass(frozen=True, eq=False)
class Frame:
    """One reconstructed frame.

    Attributes
    ----------
    number
        1 for the clip's first frame.
    density : (nx, ny, nz) float32
    velocity
        In m/s, from the frame before to this one; the first frame has the second's. Zero where no smoke is near, if it
        was estimated on a coarser grid.
    figures
        Measures of the fit and seconds spent: ``psnr`` of the clip's own pixels inside the smoke (`clip_psnr`),
        ``psnr_working`` and what else `smokelift.density.FittedDensity` says of the working pictures.
    flame : (nx, ny, nz) float32, optional
        Emission of fire, radiance per meter of the color ``flame_color`` of the scene's medium; None where the clip
        shows no fire.
    """

    number: int
    density: Volume
    velocity: Velocity
    figures: Mapping[str, Any]
    flame: Volume | None = None


def frames_after(before: CarriedState | None, shot: Shot, method: Method) -> Iterator[tuple[Frame, CarriedState]]:
    """Yield a shot's frames after one, or all, each with what it hands on.

    The first waits until the second gives it a velocity.
    """
    count = len(shot.clip)
    flow = method.optical_flow and len(shot.views) == 1 and not shot.moves
    with products_on_one_thread():
        method = replace(method, depth_prior=method.depth_prior.of_clip(shot))
        if before is not None and flow:  # a run that goes on: its state has no picture
            before = replace(before, picture=_flow_picture(_observed(before.number - 1, shot)))
    first: tuple[Frame, CarriedState] | None = None
    for index in range(before.number if before else 0, count):
        with products_on_one_thread():
            frame, before = _frame(index, before, shot, method, flow=flow)
        if index == 0 and count > 1:
            first = frame, before
            continue
        if first is not None:
            yield replace(first[0], velocity=frame.velocity), replace(first[1], velocity=before.velocity)
            first = None
        yield frame, before
        del frame  # velocities take most of the memory


def _frame(
    index: int, before: CarriedState | None, shot: Shot, method: Method, *, flow: bool
) -> tuple[Frame, CarriedState]:
    """One frame, counted from 0, from its pictures and what the frame before hands on; and what it hands on itself."""
    began = time.perf_counter()
    domain, dt = shot.optics.domain, 1.0 / shot.clip.fps
    predicted = None
    # from where there was no smoke nothing is carried
    if before is not None and index >= 2 and before.density.any():
        predicted = method.velocity_estimator.predict(before.velocity, dt)
    views = _observed(index, shot)
    fitted, taken_over = _density(views, before, predicted, shot, method)
    picture = _flow_picture(views) if flow else None
    flame = _flame(index, fitted.density, shot)
    # what a fit calls psnr is that of the working pictures; frames without smoke have none, and cost nothing
    fit = {name.replace("psnr", "psnr_working"): value for name, value in fitted.figures.items()}
    if "psnr_working" in fit:
        fit = {**clip_psnr(shot, index, fitted.density), **fit}
    fit_done = time.perf_counter()
    if before is None:
        velocity = estimated = Velocity.zero(domain.resolution, domain.voxel_size, shot.scene.closed)
    else:
        # without what is made up, if that is known of both: it shows no motion of its own
        first, second = before.smooth_density, fitted.smooth_density
        if first is None or second is None:
            first, second = before.density, fitted.density
        pair = DensityPair(first, second, dt, domain.voxel_size, shot.scene.closed, shot.scene.inflow())
        pictures = None
        if views is not None and before.picture is not None and picture is not None:
            pictures = PicturePair(before.picture, picture, views.views[0].camera, domain)
        estimated = method.velocity_estimator.estimate(pair, predicted, pictures)
        velocity = refine_near_smoke(estimated, (before.density > 0) | (fitted.density > 0), dt, domain.voxel_size)
    done = time.perf_counter()
    figures = {
        **fit,
        "mass": float(fitted.density.sum(dtype=np.float64)) * domain.voxel_size**3,
        "transport": dict(taken_over),
        "velocity": dict(velocity.figures),
        "seconds_density": fit_done - began,
        "seconds_velocity": done - fit_done,
    }
    number = index + 1
    return Frame(number, fitted.density, velocity, figures, flame), CarriedState(
        number, fitted.density, estimated, fitted.smooth_density, fitted.for_advection, picture
    )


def _observed(index: int, shot: Shot) -> ViewSet | None:
    """What the cameras saw in a frame, counted from 0; None if nothing of the domain."""
    observations = shot.observe(index)
    return ViewSet.of(observations, shot.optics, index) if observations else None


def _flow_picture(views: ViewSet | None) -> Picture | None:
    """What optical flow is found in: roots of the only camera's optical depths, so that thin smoke counts."""
    return None if views is None else np.sqrt(views.views[0].optical_depth)


def _density(
    views: ViewSet | None, before: CarriedState | None, predicted: Velocity | None, shot: Shot, method: Method
) -> tuple[FittedDensity, Mapping[str, float]]:
    """The density of a frame, the carried one where nothing is seen, and what the fit took over of the carried one."""
    if views is None:
        carried = _carried(before, predicted, shot)
        nothing: Array = np.zeros(shot.optics.domain.resolution, np.float32)
        figures: Mapping[str, float] = {"loss": 0.0, "iterations": 0.0, "hull_share": 0.0}
        return FittedDensity(nothing if carried is None else carried[0], nothing > 0, figures), {}
    depth = method.depth_prior.estimate(views)
    carried = _carried(before, predicted, shot)
    initial: Volume | None = None
    unseen: tuple[Volume, Volume] | None = None
    figures = {}
    if carried is not None:
        start = method.temporal_prior.start(depth, *carried)
        initial, figures = start.density, start.figures
        # what a moving camera does not see now it may have seen before
        unseen = carried if shot.moves else None
        del start
    priors, starts = [depth], [initial]
    del carried, depth, initial  # the fit needs the memory, and frees what it has read unless others hold it
    fitted = method.density_fit.fit(views, priors.pop(), starts.pop())
    if unseen is not None:
        visible = project_voxels(views.views[0].camera, shot.optics.domain).visible
        density, smooth = np.where(visible, fitted.density, unseen[0]), fitted.smooth_density
        if smooth is not None:
            smooth = np.where(visible, smooth, unseen[1])
        fitted = replace(fitted, density=density, smooth_density=smooth, for_advection=None)
    return fitted, figures


def _carried(before: CarriedState | None, predicted: Velocity | None, shot: Shot) -> tuple[Volume, Volume] | None:
    """The density of the frame before and its smooth density, carried along; None where there is no prediction."""
    if before is None or predicted is None:
        return None
    density = before.density if before.for_advection is None else before.for_advection
    # what a moving camera does not see no picture corrects, so that its mass has to be kept
    dt, h = 1.0 / shot.clip.fps, shot.optics.domain.voxel_size
    carried = advect_near(density, predicted, dt, h, conserve=shot.moves)
    if before.smooth_density is None:
        return carried, carried
    return carried, advect_near(before.smooth_density, predicted, dt, h, conserve=shot.moves)


def _flame(index: int, density: Volume, shot: Shot) -> Volume | None:
    """The emission in a frame; None for a clip without fire."""
    if shot.fire is None:
        return None
    seen, color = shot.observe_fire(index), np.array(shot.scene.medium.flame_color, np.float32)
    if seen is None:
        return np.zeros_like(density)
    # least squares over the channels
    return flame_emission(seen.image @ color / (color @ color), seen.camera, density, shot.optics)
