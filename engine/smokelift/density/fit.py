"""Density from pictures (algorithm 3): views and a scene's optics in, a volume that renders to the pictures out.

A depth prior gives the start, the voxels that may hold smoke, and what makes up detail that no camera sees.
`multiplicative` scales the start with that detail ray by ray until it is nearly right. From there `descent` follows the
exact gradient of the cameras' pictures.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

import smokelift._core as _core
from smokelift.checks import Mask, densities, listed, require_kind
from smokelift.density.depth_prior import DepthEstimate, RoundDepth
from smokelift.density.descent import descend
from smokelift.density.multiplicative import fit_multiplicative
from smokelift.density.objective import BLUR_REACH, FAINT, camera_terms
from smokelift.density.observation import Observation, ViewSet, eight_bit_plate
from smokelift.extraction.element import extract_element, shows_transmittance, usual_source
from smokelift.extraction.given_background import background_picture, single_color
from smokelift.extraction.plate import Plate
from smokelift.render import Image, Volume, scene_optics
from smokelift.render.device import products_on_one_thread
from smokelift.scene import CompleteScene, Scene, completed
from smokelift.scene.domain import box_around

MIN_DENSITY = 1e-9
"""Density below which a voxel is empty: no picture can show it. Libraries may switch numbers below float32's normal
range to 0 for a whole process: without this bound a resumed run would differ in its last bits."""

SINGLE_VOXELS = 1.0
"""Standard deviation (voxels) of the Gaussian that keeps of a change what lobes share
(docs/experiments/density-descent.md)."""


@dataclass(frozen=True)
class DensitySettings:
    """How a density is fitted to its pictures.

    Attributes
    ----------
    fit_iterations
        Multiplicative iterations at most, for each view, and twice as many where made-up detail is all new; the fit is
        within a few per cent after six, and each further one gains less than a step of descent costs.
    descent_iterations
        Steps of descent at most.
    tolerance
        Fraction of the objective that an iteration has to gain for another to follow.
    patience
        Steps of descent in a row without that gain which end it (density-descent.md).
    bound
        Bound of the density, in multiples of the densest voxel of the prior's estimate (or of a denser start). Where
        smoke hardly changes the picture, in shadow or before what hides it, nothing else bounds it
        (density-descent.md).

    The files are in docs/experiments.
    """

    fit_iterations: int = 6
    descent_iterations: int = 14
    tolerance: float = 0.02
    patience: int = 2
    bound: float = 3.0


@dataclass(frozen=True, eq=False)
class FittedDensity:
    """A density that was fitted to pictures, and how well it fits.

    Attributes
    ----------
    density : (nx, ny, nz) float32
    hull : (nx, ny, nz) bool
        Voxels that the fit could fill: those that the pictures allow to hold smoke and in which the depth prior expects
        any. All of them by the paper's method; none in a frame that shows nothing of the domain.
    figures
        ``loss`` (sum of squared differences over all cameras' pictures) and ``psnr`` (dB, peak 1) of the input's
        picture as its view has it, in linear radiance, over the pixels that its smoke's voxels can change, all alike;
        ``psnr_view_1``, ... of further views, each absent where its picture shows no smoke; ``relative_error``, the
        root mean square of the input's differences over that of what changes there, in all that is fitted, T of an
        element too, and with what the element leaves out as no smoke: 1 if nothing is fitted, however faint the smoke;
        ``iterations``; ``hull_share``, the hull's fraction of the voxels.
    smooth_density : (nx, ny, nz) float32, optional
        The density without made-up detail (`Detail.smooth_density`); None if nothing was made up.
    for_advection : (nx, ny, nz) float32, optional
        The density that a next frame carries along; None if that is `density`. It has what the descent changes from
        some voxels to the next, but not in single ones: that would pile up along the rays from frame to frame.
    """

    density: Volume
    hull: Mask
    figures: Mapping[str, float] = field(default_factory=dict)
    smooth_density: Volume | None = None
    for_advection: Volume | None = None


class DensityFit(Protocol):
    """A way to find a density that renders to given pictures."""

    def fit(self, views: ViewSet, depth: DepthEstimate, initial: Volume | None) -> FittedDensity:
        """Find a density.

        Parameters
        ----------
        views
            The cameras' pictures, against all voxels that they allow to hold smoke.
        depth
            What the depth prior says of them; its own views are against those of the voxels where it expects smoke.
        initial : (nx, ny, nz), optional
            Where to start, if not from the prior's density.
        """


@dataclass(frozen=True)
class GradientFit:
    """Multiplicative iterations, then descent on the exact gradient."""

    settings: DensitySettings = DensitySettings()

    def fit(self, views: ViewSet, depth: DepthEstimate, initial: Volume | None) -> FittedDensity:
        """Find a density; see `DensityFit`."""
        views, settings = depth.views, self.settings
        hull, where = views.hull, views.where
        if not where.count:
            return empty_density(views)
        cameras = camera_terms(views, depth.inside_fraction)
        start, fresh = views.volume(where.take(depth.density if initial is None else initial)), initial is None
        # The terms take turns, so several cameras need as many times more iterations.
        iterations = settings.fit_iterations * len(cameras)
        plausible = smooth = None
        if depth.detail is not None:
            plausible, smooth = depth.density, depth.detail.smooth_density
            start = depth.detail.added(start, fresh=fresh)
            iterations *= 1 + fresh  # detail that is all new is far from the pictures
        scaled = fit_multiplicative(cameras, start, iterations, settings.tolerance, where, plausible)
        expected, started = (float(where.take(values).max()) for values in (depth.density, start))
        prior = depth.density if smooth is None else smooth
        began = where.take(scaled.density)
        del depth, initial, start, plausible  # the descent needs the memory
        final = descend(
            cameras,
            scaled.density,
            where,
            settings.descent_iterations,
            settings.tolerance,
            settings.patience,
            bound=max(settings.bound * expected, started),
            expected=prior,
        )
        figures = fit_figures(views, final.residuals, scaled.iterations + final.iterations)
        for_advection = None
        if smooth is not None:
            for_advection = views.volume(began)
            if final.iterations:
                for_advection = _without_single_voxels(for_advection, final.density, hull)
        return FittedDensity(without_traces(final.density, where), hull, figures, smooth, for_advection)


def reconstruct_density(
    image: Image,
    scene: Scene,
    initial: Volume | None = None,
    settings: DensitySettings | None = None,
    *,
    plate: Plate | None = None,
    views: Sequence[Observation] = (),
) -> FittedDensity:
    """Find a density that renders to a picture, or to several (algorithm 3).

    Parameters
    ----------
    image : (rows, columns, 3)
        Linear radiance, of the size of the scene's camera.
    scene
        Needs camera and domain.
    initial : (nx, ny, nz), optional
        Where to start; by default the density of `RoundDepth` about the middle of the domain.
    settings
        How to fit.
    plate
        Background with its noise; by default the scene's background and the noise of 8 bits.
    views
        The same smoke at the same moment as other cameras saw it. What a picture does not show it says nothing about.

    Returns
    -------
    FittedDensity

    Raises
    ------
    ValueError
        If a picture is not finite or has another size than its camera, if a camera moves, if the initial density is
        negative, not finite or of another shape than the domain, or if the scene lacks a camera or a domain.

    Examples
    --------
    >>> import numpy as np
    >>> import smokelift
    >>> scene = smokelift.Scene(
    ...     camera=smokelift.Camera.look_at((0, -3, 0.5), (0, 0, 0.5), fov_y_degrees=25, size=(24, 24)),
    ...     domain=smokelift.Domain((-0.5, -0.5, 0), (0.5, 0.5, 1), (16, 16, 16)),
    ...     lights=(smokelift.DirectionalLight((0, 0.6, -0.8), (3, 3, 3)),),
    ... )
    >>> x, y, z = scene.domain.offsets(scene.domain.centre)
    >>> ball = np.exp(-(x**2 + y**2 + z**2) / 0.04)
    >>> picture = smokelift.render(ball, scene)
    >>> fitted = smokelift.reconstruct_density(picture, scene)
    >>> bool(smokelift.metrics.psnr(smokelift.render(fitted.density, scene), picture) > 30)
    True
    """
    complete = completed(scene)
    require_kind(settings, DensitySettings | None, "settings", "DensitySettings (settings.density of a run's)")
    views = listed(views, Observation, "views", "a list of Observations")
    optics = scene_optics(complete)
    own = Observation(complete.camera, image, plate)
    seen = ViewSet.of([_with_plate(each, complete) for each in (own, *views)], optics)
    if initial is not None:
        initial = densities(initial, "The initial density", optics.domain.resolution)
    with products_on_one_thread():
        estimate = RoundDepth().estimate(seen)
        return GradientFit(settings or DensitySettings()).fit(seen, estimate, initial)


def _with_plate(observation: Observation, scene: CompleteScene) -> Observation:
    """The observation, before the scene's background unless it has a plate; a picture's mean for other cameras.

    Before a picture that shows how much of it smoke lets through, its smoke is extracted.
    """
    camera, picture, plate = observation.camera, observation.image, observation.plate
    if plate is None:
        plate = eight_bit_plate(background_picture(scene, camera), camera.size)
        observation = replace(observation, plate=plate)
    if observation.element is not None or single_color(plate.image) is not None:
        return observation
    source = usual_source([(picture, plate)], camera.size)
    if not shows_transmittance(plate.image, source):
        return observation
    return replace(observation, element=extract_element(picture, plate, source, camera.size))


def empty_density(views: ViewSet) -> FittedDensity:
    """The empty result: no smoke is seen, or the views have no voxel in common."""
    residuals = [view.background - view.image for view in views.views]
    return FittedDensity(np.zeros(views.hull.shape, np.float32), views.hull, fit_figures(views, residuals, 0))


def without_traces(density: Volume, within: _core.MarkedVoxels) -> Volume:
    """The density at some voxels, without values below `MIN_DENSITY`."""
    values = within.take(density)
    values[values < MIN_DENSITY] = 0
    result = np.zeros(density.shape, np.float32)
    within.put(values, result)
    return result


def _without_single_voxels(before: Volume, after: Volume, hull: Mask) -> Volume:
    """The density before a descent with the descent's changes, but for those of single voxels, in its place."""
    box = box_around(hull, 1)
    below, changed = (_core.blur(each[box], SINGLE_VOXELS, BLUR_REACH) for each in (before, after))
    faint = FAINT * float(below.max())
    changed += faint
    below += max(faint, MIN_DENSITY)
    changed /= below
    before[box] *= changed
    return before


def fit_figures(views: ViewSet, residuals: Sequence[Image], iterations: int) -> dict[str, float]:
    """Figures of a fit (see `FittedDensity`) from its residuals (rows, columns, channels), at least one per view."""
    losses, decibels = [], {}
    for number, (view, residual) in enumerate(zip(views.views, residuals, strict=False)):
        left = residual[view.influenced][:, :3]
        losses.append(float(np.sum(np.square(left, dtype=np.float64))))
        if left.size:
            name = f"psnr_view_{number}" if number else "psnr"
            decibels[name] = float(-10 * np.log10(max(losses[-1] / left.size, 1e-12)))
    front = views.views[0]

    def power(values: Image) -> float:
        return float(np.sum(np.square(values[front.influenced], dtype=np.float64)))

    # an assumed light makes the picture wrong, and what is no smoke T, too
    change, other = front.image - front.background, power(front.left_out)
    smoke = power(change[..., :3])
    lost = power(residuals[0]) * (smoke / power(change)) if smoke > 0 else 0.0
    return {
        "loss": sum(losses),
        **decibels,
        **({"relative_error": math.sqrt((lost + other) / (smoke + other))} if smoke > 0 else {}),
        "iterations": float(iterations),
        "hull_share": np.count_nonzero(views.hull) / views.hull.size,
    }
