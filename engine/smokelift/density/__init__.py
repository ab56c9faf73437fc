"""Density from one image (algorithm 3): a picture and a scene in, a volume that renders to the picture out.

``hull`` says where smoke can be, ``profile`` gives a start with a plausible depth, ``multiplicative`` scales it ray
by ray until it is nearly right, ``descent`` follows the exact gradient from there. ``paper`` is the paper's own way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from smokelift.baselines.descent import fit_paper
from smokelift.density.axis import SmokeAxis
from smokelift.density.descent import descend
from smokelift.density.evidence import Evidence, ViewEvidence
from smokelift.density.hull import project_voxels, reached
from smokelift.density.multiplicative import RayTarget, fit_multiplicative
from smokelift.density.observation import Observation
from smokelift.footage.images import srgb_to_linear
from smokelift.footage.matte import matte
from smokelift.footage.noise import EIGHT_BIT_STEP
from smokelift.footage.plate import Plate, noise_at
from smokelift.render import Renderer, scene_background, scene_lights
from smokelift.render.light_sweeps import unshadowed_source
from smokelift.render.renderer import Image, Volume
from smokelift.scene import Camera, Domain, Medium, Scattering, Scene, orbit

__all__ = [
    "Density",
    "DensitySettings",
    "Observation",
    "SmokeAxis",
    "depth_guess",
    "fit_density",
    "gather_evidence",
    "optical_depth",
    "reconstruct_density",
]


TRACE = 1e-9
"""Density below which a voxel is empty: nothing can show it, and what a process does with numbers below float's normal
range (libraries may switch that) does not reach it."""

LEAST_SHARE = 0.3
"""Weight of rays that meet none of the depth profile inside the domain: with less, smoke that stands elsewhere than the
profile says is missing in the picture; with more, clots grow at the floor and the ceiling."""

DENSEST = 3.0
"""Multiple of the densest in the pictures' own guess (or in a denser start) beyond which nothing is made denser. The
guess knows of no shadows and is smooth, so more than once is needed; from 3 on the picture is met as without a bound.
Where it hardly changes with the smoke, in shadow or before what hides it, nothing else ends the smoke's growth: carried
along it grew from frame to frame, to thousands of times the density around it (docs/accuracy.md)."""


@dataclass(frozen=True)
class DensitySettings:
    """How a density is fitted to a picture.

    Attributes
    ----------
    method
        ``"default"``, or ``"paper"``: fixed-rate gradient descent, the picture imposed at 90 degrees as well.
    scattering
        ``"single"`` (self-shadowed), ``"unshadowed"``, ``"absorption"``, or ``"auto"``: for a clip the cheapest that
        does (see `smokelift.setup`), for a single picture ``"single"``.
    fit_iterations
        Multiplicative iterations at most; the fit is within a few per cent after six, and each further one gains
        less than a step of descent costs.
    descent_iterations
        Steps of descent at most; for the paper's method, all its iterations.
    tolerance
        An iteration that lowers the loss by less than this share is the last.
    paper_rate
        Paper's method: change of density that one step makes in the steepest voxel of thin fog. The paper gives
        no figure; see docs/measurements.md for what more and less do.
    texture
        Noise along the depth, 0 to 1: without any, smoke is smooth from the side. 0.4 looks most like smoke and costs
        0.1 to 0.2 dB in new views; the noise stands still while the smoke moves. Only for one view.
    """

    method: Literal["default", "paper"] = "default"
    scattering: Scattering | Literal["auto"] = "auto"
    fit_iterations: int = 6
    descent_iterations: int = 12
    tolerance: float = 0.02
    paper_rate: float = 0.03
    texture: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.texture <= 1:
            raise ValueError(f"texture must be a number from 0 to 1, not {self.texture}.")
        if self.scattering not in ("auto", *get_args(Scattering)):
            known = ", ".join(("auto", *get_args(Scattering)))
            raise ValueError(f"scattering must be one of {known}, not {self.scattering!r}.")

    @property
    def model(self) -> Scattering:
        """The model of scattering, the richest where it was left open."""
        return "single" if self.scattering == "auto" else self.scattering


@dataclass(frozen=True, eq=False)
class Density:
    """A reconstructed density.

    Attributes
    ----------
    values : (nx, ny, nz) float32
    hull : (nx, ny, nz) bool
        Voxels that the pictures allow to hold smoke.
    figures
        ``loss`` (sum of squares over all pictures) and ``psnr`` (dB, peak 1) of the picture, in linear radiance, over
        the pixels that its smoke's voxels can change; ``psnr_view_1``, ... of further views; ``iterations``;
        ``hull_share``, the hull's share of the voxels.
    """

    values: Volume
    hull: NDArray[np.bool_]
    figures: Mapping[str, float] = field(default_factory=dict)


def reconstruct_density(
    image: Image,
    scene: Scene,
    initial: Volume | None = None,
    settings: DensitySettings | None = None,
    *,
    plate: Plate | None = None,
    axis: SmokeAxis | None = None,
    views: Sequence[Observation] = (),
) -> Density:
    """Find a density that renders to a picture, or to several (algorithm 3).

    Parameters
    ----------
    image : (rows, columns, 3)
        Linear radiance, of the size of the scene's camera.
    scene
        Needs camera and domain.
    initial : (nx, ny, nz), optional
        First guess; by default that of `depth_guess`.
    settings
        How to fit.
    plate
        Background with its noise; by default the scene's background and the noise of 8 bits.
    axis
        Where in depth the smoke stands; by default on the domain's axis. Further views know better.
    views
        The same smoke at the same moment as other cameras saw it. What a picture does not show it says nothing about.

    Raises
    ------
    ValueError
        If a picture is not finite or has another size than its camera, if a camera moves, if the initial density is
        negative, not finite or of another shape than the domain, or if the scene lacks a camera or a domain.
    """
    settings = settings or DensitySettings()
    if scene.camera is None or scene.domain is None:
        raise ValueError("A reconstruction needs a scene with a camera and a domain.")
    seen = gather_evidence(image, scene, settings, plate, axis, views)
    if initial is not None:
        initial = _checked_initial(initial, scene.domain)
    return fit_density(seen, scene, initial, settings)


def gather_evidence(
    image: Image,
    scene: Scene,
    settings: DensitySettings,
    plate: Plate | None = None,
    axis: SmokeAxis | None = None,
    views: Sequence[Observation] = (),
) -> Evidence:
    """What the pictures say before anything is fitted; the parameters are those of `reconstruct_density`."""
    assert scene.camera is not None and scene.domain is not None
    observations = (Observation(scene.camera, image, plate), *views)
    seen = [_view(observation, scene, settings) for observation in observations]
    return Evidence(seen, scene.domain, axis or SmokeAxis.upright(), settings.texture)


def depth_guess(seen: Evidence, scene: Scene) -> Volume:
    """Density (nx, ny, nz) from pictures alone: unshadowed optical depths, spread by the depth profiles."""
    return seen.guess / np.float32((scene.medium or Medium()).extinction)


def fit_density(seen: Evidence, scene: Scene, initial: Volume | None, settings: DensitySettings) -> Density:
    """Find a density that explains what was seen, from a first guess; by default that of `depth_guess`."""
    assert scene.domain is not None
    domain, medium, hull = scene.domain, scene.medium or Medium(), seen.hull
    pixels = [int(view.counts.sum()) for view in seen.views]
    if not hull.any():
        # one picture without smoke, or several that contradict each other
        left = [(view.image - view.plate.image)[view.counts] for view in seen.views]
        losses = [float(np.sum(np.square(part, dtype=np.float64))) for part in left]
        return Density(np.zeros(domain.resolution, np.float32), hull, _figures(losses, pixels, 0, hull))
    if settings.method == "paper":
        return _paper(seen, scene, initial, settings)
    lights = scene_lights(scene)
    # beyond this the fit would reproduce noise (discrepancy principle)
    enough = 0.0
    targets = []
    for view, profile in zip(seen.views, seen.profiles, strict=True):
        renderer = Renderer(view.camera, domain, medium, lights, view.plate.image, settings.model, hull)
        # a ray that leaves through floor or ceiling crosses few voxels, which must not hold all that it shows
        weight = view.counts * np.maximum(profile.share_inside(), LEAST_SHARE)
        noise = noise_at(view.image, view.plate)
        enough += float(np.sum(np.square(noise[view.counts], dtype=np.float64)))
        targets.append(RayTarget(renderer, view.image, weight, view.plate.image, noise, view.projection))
    guess = depth_guess(seen, scene)
    start = np.where(hull, guess if initial is None else initial, 0).astype(np.float32)
    # what several pictures have in common takes as many times longer to be found
    iterations = settings.fit_iterations * len(targets)
    fit = fit_multiplicative(targets, start, enough, iterations, settings.tolerance)
    densest = float(max(DENSEST * guess.max(), start.max()))
    final = descend(targets, fit.density, hull, enough, settings.descent_iterations, settings.tolerance, densest)
    return Density(
        _without_traces(final.density),
        hull,
        _figures(final.losses, pixels, fit.iterations + final.iterations, hull),
    )


def _view(observation: Observation, scene: Scene, settings: DensitySettings) -> ViewEvidence:
    assert scene.domain is not None
    camera = observation.camera
    if camera.moves:
        raise ValueError("The camera moves; give the scene the one of the picture's frame, camera.at(frame).")
    image = _checked_image(observation.image, camera)
    plate = observation.plate or _clean_plate(scene, camera)
    mask = matte(image, plate).mask
    projection = project_voxels(camera, scene.domain)
    amount = _amount(image, scene, settings, plate, mask)
    return ViewEvidence(camera, image, plate, mask, amount, projection, reached(mask, projection))


def optical_depth(image: Image, scene: Scene, settings: DensitySettings, plate: Plate) -> NDArray[np.float32]:
    """Optical depth (rows, columns) of unshadowed smoke that explains the picture: I = J (1 - t) + t B."""
    return _amount(image, scene, settings, plate, matte(image, plate).mask)


def _amount(
    image: Image, scene: Scene, settings: DensitySettings, plate: Plate, mask: NDArray[np.bool_]
) -> NDArray[np.float32]:
    assert scene.domain is not None
    source = np.zeros(3)
    if settings.scattering != "absorption":
        source = unshadowed_source(scene_lights(scene), scene.medium or Medium(), scene.domain)
    contrast = plate.image - source
    power = np.sum(contrast**2, -1)
    clear = np.sum((image - source) * contrast, -1) / np.maximum(power, 1e-12)
    depth = -np.log(np.clip(clear, 0.05, 1.0))
    return np.where(mask, depth, 0).astype(np.float32)


def _paper(seen: Evidence, scene: Scene, initial: Volume | None, settings: DensitySettings) -> Density:
    from smokelift.baselines.renderer import PaperRenderer  # here, because Taichi takes long to import

    assert scene.domain is not None
    domain, medium = scene.domain, scene.medium or Medium()
    lights = scene_lights(scene)
    views = seen.views
    if len(views) == 1:
        # the paper's own way: the picture again as if from the side
        views = (views[0], replace(views[0], camera=orbit(views[0].camera, domain, 90)))
    renderers = [PaperRenderer(view.camera, domain, medium, lights, view.plate.image, settings.model) for view in views]
    # fog of optical depth 0.1 across the domain: thin, because dense media have local minima
    thin = 0.1 / (medium.extinction * (domain.max[0] - domain.min[0]))
    fog = np.full(domain.resolution, thin, np.float32)
    start = fog if initial is None else initial
    pictures = [view.image for view in views]
    fit = fit_paper(renderers, pictures, start, fog, settings.paper_rate, 1e-4, settings.descent_iterations)
    pixels = [view.mask.size for view in seen.views]
    everywhere = np.ones(domain.resolution, np.bool_)
    losses = fit.losses[: len(pixels)]
    return Density(_without_traces(fit.density), everywhere, _figures(losses, pixels, fit.iterations, everywhere))


def _without_traces(density: Volume) -> Volume:
    """The density without what no picture can show.

    Numbers near the end of float32's range are 0 to a processor that flushes them, and libraries switch that on or off
    for a whole process: a resumed run would not be the same to the bit.
    """
    return np.where(density < TRACE, np.float32(0), density)


def _clean_plate(scene: Scene, camera: Camera) -> Plate:
    width, height = camera.size
    picture = np.broadcast_to(scene_background(scene, camera), (height, width, 3)).astype(np.float32)
    return Plate(picture, np.ones((height, width), np.float32), srgb_to_linear(np.full(3, EIGHT_BIT_STEP)))


def _figures(
    losses: Sequence[float], pixels: Sequence[int], iterations: int, hull: NDArray[np.bool_]
) -> dict[str, float]:
    errors = [loss / (3 * max(count, 1)) for loss, count in zip(losses, pixels, strict=True)]
    decibels = [float(-10 * np.log10(max(error, 1e-12))) for error in errors]
    return {
        "loss": sum(losses),
        "psnr": decibels[0],
        **{f"psnr_view_{number}": value for number, value in enumerate(decibels[1:], 1)},
        "iterations": float(iterations),
        "hull_share": float(hull.mean()),
    }


def _checked_image(image: Image, camera: Camera) -> Image:
    image = np.asarray(image, np.float32)
    width, height = camera.size
    if image.shape != (height, width, 3):
        raise ValueError(f"The picture must have the shape {(height, width, 3)} of the camera, not {image.shape}.")
    if not np.isfinite(image).all():
        raise ValueError("The picture holds values that are not finite.")
    return image


def _checked_initial(initial: Volume, domain: Domain) -> Volume:
    initial = np.asarray(initial, np.float32)
    if initial.shape != domain.resolution:
        raise ValueError(f"The initial density must have the shape {domain.resolution}, not {initial.shape}.")
    if not np.isfinite(initial).all() or initial.min() < 0:
        raise ValueError("The initial density must be finite and not negative.")
    return initial
