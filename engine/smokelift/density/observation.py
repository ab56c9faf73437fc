"""What cameras saw of the smoke at one moment, and what each picture alone says on the grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.checks import radiance, require_kind
from smokelift.density.axis import AxisEstimate
from smokelift.density.colour_weight import ColourWeight
from smokelift.density.hull import Places, Projection, common_hull, project_voxels, reached
from smokelift.footage.matte import matte
from smokelift.footage.noise import EIGHT_BIT_NOISE
from smokelift.footage.plate import Plate, noise_at
from smokelift.render import Image, Optics, Renderer
from smokelift.scene import SHADOWED, Camera, Domain, Inlet
from smokelift.scene.checks import LARGEST

THINNEST_CLEAR = 0.05
"""Lower bound of the transmittance: a brightness does not show an optical depth above 3."""

SHADED, PATCH = 4.0, 3
"""Noise by which a shaded side of smoke turns away from its source radiance, and pixels along it, at least
(docs/experiments/bright-background.md)."""

SHADED_DEPTH = 1.5
"""Optical depth over ln(1 + r), r the share of the contrast that a pixel shows: right where that is about a half
(docs/experiments/thick-smoke.md)."""

MAX_DARK_RADIANCE = 0.1
"""Largest radiance of a dark background over the smoke's source radiance. Before a brighter one a picture itself tells
smoke in shadow from thin smoke."""

MIN_CONTRAST = 0.1
"""Contrast of the background to the source radiance in shadow, over that without shadows, below which the latter tells
more: in deep shadow noise would be taken for smoke."""

ROUNDS = 2
"""Times that optical depth and the weight of the colours are each found from the other."""


def eight_bit_plate(background: Image, size: tuple[int, int]) -> Plate:
    """The plate of a known background (rows, columns, 3) or (3,), of a camera's size, with the noise of 8 bits."""
    width, height = size
    picture = np.broadcast_to(background, (height, width, 3)).astype(np.float32)
    return Plate(picture, np.ones((height, width), np.float32), EIGHT_BIT_NOISE)


BLACK = eight_bit_plate(np.zeros(3, np.float32), (1, 1))
"""Stands for a black plate of any size."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One camera's picture of the smoke at one moment.

    Attributes
    ----------
    camera
        That stands still.
    image : (rows, columns, 3)
        Linear radiance, of the camera's size.
    plate
        The clean plate: what the camera sees without smoke, with the noise of its pictures. By default black with the
        noise of 8 bits, for which `reconstruct_density` substitutes the scene's background.

    Raises
    ------
    ValueError
        If one of them is of another kind.
    """

    camera: Camera
    image: Image
    plate: Plate = BLACK

    def __post_init__(self) -> None:
        require_kind(self.camera, Camera, "camera", "a Camera")
        require_kind(self.plate, Plate, "plate", "a Plate (a known picture is the scene's background)")
        object.__setattr__(self, "image", radiance(self.image, "The picture"))


class ObservedClip(Protocol):
    """A clip as its cameras saw it, frame by frame; `smokelift.setup.shot.Shot` is one."""

    @property
    def optics(self) -> Optics:
        """How light travels through the domain."""

    @property
    def inlets(self) -> tuple[Inlet, ...]:
        """Where smoke is known to enter."""

    @property
    def moves(self) -> bool:
        """Whether a camera moves."""

    @property
    def place(self) -> AxisEstimate | None:
        """Where in depth the smoke was found to stand (`density.clip_axis`); None where it was not estimated."""

    @property
    def length(self) -> int:
        """Number of frames."""

    def spread(self, count: int) -> tuple[int, ...]:
        """Numbers of so many frames at most, from 0, spread evenly over the clip."""

    def observe(self, frame: int) -> tuple[Observation, ...]:
        """What the cameras saw in a frame, from 0, the input's first; empty if it shows nothing of the domain."""


@dataclass(frozen=True, eq=False)
class ObservedView:
    """An observation against the grid.

    Attributes
    ----------
    image : (rows, columns, 3)
        The observation's, faded to the plate by `share`: so a faint rim ends where its light does, not at the mask.
    share : (rows, columns)
        How certainly a pixel shows smoke, from 0 to 1; what is left of the observation and of its noise.
    mask : (rows, columns) bool
        Pixels that may show smoke: where `share` is not 0.
    optical_depth : (rows, columns)
        Of smoke without shadows that explains the picture, or as much as can be shown where only smoke in its own
        shadow does; 0 outside the mask.
    counted : (rows, columns) bool
        Pixels that the voxels behind the mask can change: a fit is judged by them.
    colours
        How much each combination of the colours counts; None if all do alike, as before a background that is known.
    """

    camera: Camera
    image: Image
    plate: Plate
    share: NDArray[np.float32]
    mask: NDArray[np.bool_]
    optical_depth: NDArray[np.float32]
    projection: Projection
    counted: NDArray[np.bool_]
    colours: ColourWeight | None = None

    @staticmethod
    def of(observation: Observation, optics: Optics) -> ObservedView:
        """Set an observation against the grid of `optics.domain`."""
        camera, image, plate = observation.camera, observation.image, observation.plate
        if plate is BLACK:
            plate = eight_bit_plate(np.zeros(3, np.float32), camera.size)
        share = matte(image, plate).share
        image = plate.image + share[..., None] * (image - plate.image)
        mask = share > 0
        projection = project_voxels(camera, optics.domain)
        depth = apparent_optical_depth(image, plate, mask, optics)
        colours = ColourWeight.of(image, plate, depth)
        if colours is not None:  # each depends on the other
            for _ in range(ROUNDS):
                depth = apparent_optical_depth(image, plate, mask, optics, colours)
                colours = ColourWeight.of(image, plate, depth)
        return ObservedView(camera, image, plate, share, mask, depth, projection, reached(mask, projection), colours)

    def weighted(self, colours: Image) -> Image:
        """Colours (rows, columns, 3), weighed by how much they count."""
        return colours if self.colours is None else self.colours.weighted(colours)

    def before_darkness(self, source: NDArray[np.float64]) -> bool:
        """Whether the background is dark beside a source radiance (3,) wherever smoke shows."""
        return bool((self.plate.image[self.mask] <= MAX_DARK_RADIANCE * source).all())

    @cached_property
    def noise(self) -> Image:
        """Standard deviation (rows, columns, 3) of the observation's noise, linear radiance."""
        return noise_at(self.image, self.plate)

    @cached_property
    def noise_left(self) -> Image:
        """Standard deviation (rows, columns, 3) of the noise of `image`, faded like it."""
        return self.share[..., None] * self.noise


@dataclass(frozen=True, eq=False)
class ViewSet:
    """All views of one moment, the input's first.

    `hull` (nx, ny, nz) marks the voxels that all of them allow to hold smoke. `frame` is the number of the moment in
    its clip, from 0: a depth prior that has seen the clip knows the other moments.
    """

    views: tuple[ObservedView, ...]
    hull: NDArray[np.bool_]
    optics: Optics
    frame: int = 0

    @cached_property
    def where(self) -> NDArray[np.intp]:
        """The hull's voxels (n,) in the flat grid: reading an array at them leaves the memory between untouched."""
        return np.flatnonzero(self.hull)

    @cached_property
    def places(self) -> tuple[Places, ...]:
        """Where the hull's voxels lie in each view's picture, in the same order."""
        return tuple(view.projection.places(self.hull) for view in self.views)

    @cached_property
    def renderers(self) -> tuple[Renderer, ...]:
        """Renderers of the views, for densities in the hull."""
        return tuple(self.optics.renderer(view.camera, view.plate.image, self.hull) for view in self.views)

    @staticmethod
    def of(observations: Sequence[Observation], optics: Optics, frame: int = 0) -> ViewSet:
        """Set observations of one moment against the grid.

        It raises ValueError if a picture is not finite or has another size than its camera, or if a camera moves or
        stands inside the domain.
        """
        for observation in observations:
            _check(observation, optics.domain)
        views = tuple(ObservedView.of(observation, optics) for observation in observations)
        hull = common_hull([view.mask for view in views], [view.projection for view in views])
        return ViewSet(views, hull, optics, frame)


def apparent_optical_depth(
    image: Image, plate: Plate, mask: NDArray[np.bool_], optics: Optics, colours: ColourWeight | None = None
) -> NDArray[np.float32]:
    """Optical depth (rows, columns) of smoke without shadows that explains a picture: I = J (1 - T) + T B.

    J is the source radiance of smoke in the middle of the domain, B the plate. T is the least squares solution over the
    three channels, or over their combinations as much as they count. No T explains a pixel that the smoke darkens
    although J is brighter than B. Only smoke in its own shadow does so. Such a pixel counts as thick as can be shown: a
    fit that starts from less thins it out until nothing is left (docs/experiments/bright-background.md).
    """
    source = np.zeros(3)
    if optics.scattering != "absorption":
        source = optics.unshadowed_source()
    contrast = plate.image - source
    counted = contrast if colours is None else colours.weighted(contrast)
    clear = np.sum((image - source) * counted, -1) / np.maximum(np.sum(contrast * counted, -1), 1e-12)
    depth = -np.log(np.clip(clear, THINNEST_CLEAR, 1.0))
    if optics.scattering in SHADOWED:
        depth[_in_shadow(image, plate, mask, contrast)] = -np.log(THINNEST_CLEAR)
    return np.where(mask, depth, 0).astype(np.float32)


def shadowed_optical_depth(
    view: ObservedView, image: Image, transmittance: NDArray[np.float32], optics: Optics
) -> NDArray[np.float32]:
    """Optical depth (rows, columns) that explains a view's picture in an estimate's shadows: SHADED_DEPTH ln(1 + r).

    The estimate has the view's optical depth. ``image`` (rows, columns, 3) and ``transmittance`` (rows, columns) are
    what the view's camera sees of it before the view's plate B. Its source radiance is J = (image - T B) / (1 - T), and
    r is the share of the contrast B - J that the view shows. If J were right the optical depth would be -ln(1 - r),
    which has no bound as r nears 1. But where the shadows fall is only assumed, so J may be off by a factor of two.
    """
    plate, clear = view.plate.image, transmittance[..., None]
    contrast = plate - (image - clear * plate) / np.maximum(1 - clear, 1e-6)
    usual = plate - optics.unshadowed_source()
    counted = view.weighted(contrast)
    least = MIN_CONTRAST**2 * np.sum(usual * view.weighted(usual), -1)
    seen = np.sum((plate - view.image) * counted, -1) + least * -np.expm1(-view.optical_depth)
    share = seen / np.maximum(np.sum(contrast * counted, -1) + least, 1e-12)
    known = (share > 0) & (view.optical_depth < -0.99 * np.log(THINNEST_CLEAR))  # else as thick as can be shown
    depth = np.where(known, SHADED_DEPTH * np.log1p(np.maximum(share, 0)), view.optical_depth)
    return np.where(view.mask, depth, 0).astype(np.float32)


def _in_shadow(image: Image, plate: Plate, mask: NDArray[np.bool_], contrast: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where smoke has to be in its own shadow: it turns the picture away from its source radiance.

    ``contrast`` (rows, columns, 3) is that of the background to the source radiance. A background that is continued
    from around the smoke may as well be too bright, by its errors. A shaded side is a patch of pixels; single ones are
    a codec's errors.
    """
    away = np.sum((image - plate.image) * contrast, -1)
    noise = np.sum((noise_at(image, plate) * contrast) ** 2, -1)
    if plate.errors.any():
        noise += (1 - plate.confidence) * np.sum((contrast @ plate.errors) * contrast, -1)
    beyond = (away > SHADED * np.sqrt(noise)) & mask
    return np.asarray(ndimage.binary_opening(beyond, np.ones((PATCH, PATCH))))


def _check(observation: Observation, domain: Domain) -> None:
    camera, image = observation.camera, observation.image
    camera.require_outside(domain)
    if camera.moves:
        raise ValueError("The camera moves; give the scene the one of the picture's frame, camera.at(frame).")
    width, height = camera.size
    if image.shape != (height, width, 3):
        raise ValueError(f"The picture must have the shape {(height, width, 3)} of the camera, not {image.shape}.")
    if not (np.abs(image) <= LARGEST).all():
        raise ValueError(f"The picture holds values that are not finite, or beyond {LARGEST:g}; clamp them first.")
