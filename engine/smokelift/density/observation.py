"""What cameras saw of the smoke at one moment, and what each picture alone says on the grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Array, Doubles, Mask, radiance, require_kind
from smokelift.density.hull import Projection, common_hull, project_voxels, reached
from smokelift.density.upright_plane import AxisEstimate
from smokelift.extraction.element import BRIGHTNESS_RANGE, Element
from smokelift.extraction.matte import certainty, matte
from smokelift.extraction.plate import Plate, noise_at
from smokelift.footage.images import area_average, channel_mean
from smokelift.footage.noise import EIGHT_BIT_NOISE
from smokelift.render import Image, Optics, Renderer, Volume
from smokelift.scene import SHADOWED, Camera, Domain, Inlet
from smokelift.scene.camera import voxel_width
from smokelift.scene.checks import LARGEST

THINNEST_CLEAR = 0.05
"""Lower bound of the transmittance: a brightness does not show an optical depth above 3."""

MAX_KNOWN_DEPTH = 0.99
"""Fraction of the optical depth at `THINNEST_CLEAR` from which one counts as that, and so as unknown; rounding makes it
a little less."""

SHADED, PATCH = 4.0, 3
"""Distance, in units of noise, by which a shaded side of smoke turns away from its source radiance, and pixels along
it, at least (docs/experiments/thick-smoke.md)."""

SHADED_DEPTH = 1.5
"""Optical depth over ln(1 + r), r the fraction of the contrast that a pixel shows: right where that is about a half
(docs/experiments/thick-smoke.md)."""

MAX_DARK_RADIANCE = 0.1
"""Largest radiance of a dark background over the smoke's source radiance. Before a brighter one a picture itself tells
smoke in shadow from thin smoke."""

MIN_CONTRAST = 0.1
"""Contrast of the background to the source radiance in shadow, over that without shadows, below which the latter tells
more: in deep shadow noise would be taken for smoke."""

WHITE, WHITE_IN_ASSUMED_LIGHT = 1.5, 6.0
"""Brightness of the white that T is shown over, over that of the plate or of what the smoke sends, whichever is
brighter: with half of it smoke of the plate's own brightness is not fitted, with twice of it errors of T are fitted
rather than the picture. In an assumed light the errors of what the smoke sends are several times as large, and with a
dimmer white its shaded side is fitted as a hole (docs/experiments/extraction.md)."""

MIN_SENT = 0.1
"""Radiance over the brightness of smoke or plate below which what an element sends counts as none: hair before a wall,
taken for smoke, sends none, smoke in shadow .2 of the usual or more (measured on a plume)."""

USEFUL_DEVIATION = 0.4
"""Deviation of T beyond which it shows little: smoke is clear air or not, by one and a half of it to either side."""

CLEAR_QUANTILE, CLEAR_DEVIATIONS = 0.98, 2.33
"""Quantile of the opacity that is found in clear air, and the deviations of normal noise's size there. With .9 and
1.645 a codec's errors at the rim of a puff are taken for smoke (measured)."""

MIN_OPACITY_NOISE = 0.01
"""Smallest opacity that noise is taken to have: a step or two of eight bits before a bright plate."""

OPACITY_WIDTH = 2.0
"""Standard deviation, in pixels, of the Gaussian whose noise is as smooth as that of an opacity."""

MIN_WEIGHT = 1e-6
"""Weight of a plate that is not known at all in its mean color, and smallest sum of an opacity that is divided by."""


def eight_bit_plate(background: Image, size: tuple[int, int]) -> Plate:
    """The plate of a known background (rows, columns, 3) or (3,), of a camera's size, with the noise of 8 bits."""
    width, height = size
    picture = np.broadcast_to(background, (height, width, 3)).astype(np.float32)
    return Plate(picture, np.ones((height, width), np.float32), EIGHT_BIT_NOISE)


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
        The clean plate: what the camera sees without smoke, with the noise of its pictures. None stands for black with
        the noise of 8 bits (`clean_plate`), and in `reconstruct_density` for the scene's background.
    element
        The smoke without the plate; None where the picture itself tells as much, as before black or one color.
    light_assumed
        Whether nothing is known of the light, so that T tells more of the smoke than what it sends.

    Raises
    ------
    ValueError
        If one of them is of another kind.
    """

    camera: Camera
    image: Image
    plate: Plate | None = None
    element: Element | None = None
    light_assumed: bool = False

    def __post_init__(self) -> None:
        require_kind(self.camera, Camera, "camera", "a Camera")
        require_kind(self.plate, Plate | None, "plate", "a Plate (a known picture is the scene's background)")
        object.__setattr__(self, "image", radiance(self.image, "The picture"))

    @property
    def clean_plate(self) -> Plate:
        """The plate, or a black one in its place."""
        return eight_bit_plate(np.zeros(3, np.float32), self.camera.size) if self.plate is None else self.plate


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

    A picture that tells its own transmittance has three channels. An element has a fourth, in which smoke is black: it
    is shown over one color, so that nothing of the plate's detail is left in it, and over a white of its own.
    """

    camera: Camera
    image: Image
    """(rows, columns, channels): the observation's, faded to the background by `probability`: so a faint rim ends where
    its light does, not at the mask."""
    background: Image
    """(rows, columns, channels): what the picture shows without smoke."""
    noise: Image
    """(rows, columns, channels): standard deviation of the observation's noise."""
    left_out: Image
    """(rows, columns, 3): what an element leaves of the observation since it is neither smoke nor its plate; faded like
    the image."""
    probability: Array
    """(rows, columns): probability that a pixel shows smoke; what is left of the observation and of its noise."""
    mask: Mask
    """(rows, columns) bool: pixels that may show smoke: where `probability` is not 0."""
    optical_depth: Array
    """(rows, columns): of smoke without shadows that explains the picture; 0 outside the mask."""
    projection: Projection
    influenced: Mask
    """(rows, columns) bool: pixels that the voxels behind the mask can change: a fit is judged by them."""

    @staticmethod
    def of(observation: Observation, optics: Optics) -> ObservedView:
        """Set an observation against the grid of `optics.domain`."""
        camera, plate = observation.camera, observation.clean_plate
        probability = matte(observation.image, plate).probability
        if observation.element is None:
            image, background, noise = observation.image, plate.image, noise_at(observation.image, plate)
            left_out = np.zeros_like(image)
        else:
            image, background, noise = _over_one_color(observation, observation.element, plate)
            left_out = observation.image - observation.element.over(plate.image)
            probability = np.maximum(probability, _faint_smoke(observation.element, probability == 0))
        image = background + probability[..., None] * (image - background)
        return _against_grid(camera, image, background, noise, probability[..., None] * left_out, probability, optics)

    def coarser(self, optics: Optics) -> ObservedView:
        """Set the observation against another grid, at one pixel per voxel if its own pixels are finer."""
        shrink = max(1.0, voxel_width(self.camera, optics.domain))
        columns, rows = (max(1, round(side / shrink)) for side in self.camera.size)
        pictures = (self.image, self.background, self.noise, self.left_out, self.probability)
        image, background, noise, left_out, probability = (area_average(each, columns, rows) for each in pictures)
        return _against_grid(
            self.camera.resized(columns, rows), image, background, noise, left_out, probability, optics
        )

    def against_darkness(self, source: Doubles) -> bool:
        """Whether the background is dark beside a source radiance (3,) wherever smoke shows."""
        return bool((self.background[self.mask] <= MAX_DARK_RADIANCE * _in_channels(source, self.background)).all())

    @cached_property
    def noise_left(self) -> Image:
        """Standard deviation (rows, columns, channels) of the noise of `image`, faded like it."""
        return self.probability[..., None] * self.noise


@dataclass(frozen=True, eq=False)
class ViewSet:
    """All views of one moment, the input's first.

    `hull` (nx, ny, nz) marks the voxels that may hold smoke: those that all of them allow, or fewer where a depth prior
    expects none (`DepthEstimate.views`). `frame` is the number of the moment in its clip, from 0.
    """

    views: tuple[ObservedView, ...]
    hull: Mask
    optics: Optics
    frame: int = 0

    @cached_property
    def where(self) -> _core.MarkedVoxels:
        """The hull's voxels: reading a volume at them leaves the memory between untouched."""
        return _core.MarkedVoxels(self.hull)

    def volume(self, values: NDArray[np.floating[Any]]) -> Volume:
        """A volume (nx, ny, nz) of values (n,) at the hull's voxels, zero elsewhere.

        Memory is taken where something is written, so that of a density follows the smoke, not the box.
        """
        result = np.zeros(self.hull.shape, np.float32)
        self.where.put(values, result)
        return result

    @cached_property
    def renderers(self) -> tuple[Renderer, ...]:
        """Renderers of the views, for densities in the hull."""
        return tuple(self.optics.renderer(view.camera, view.background, self.hull) for view in self.views)

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


def _against_grid(
    camera: Camera, image: Image, background: Image, noise: Image, left_out: Image, probability: Array, optics: Optics
) -> ObservedView:
    """A picture, faded to its background, against the grid of `optics.domain`."""
    mask = probability > 0
    projection = project_voxels(camera, optics.domain)
    depth = _apparent_optical_depth(image, background, noise, mask, optics)
    influenced = reached(mask, projection)
    return ObservedView(camera, image, background, noise, left_out, probability, mask, depth, projection, influenced)


def _apparent_optical_depth(image: Image, background: Image, noise: Image, mask: Mask, optics: Optics) -> Array:
    """Optical depth (rows, columns) of smoke without shadows that explains a picture: I = J (1 - T) + T B.

    J is the source radiance of smoke in the middle of the domain, B the background. T is the least squares solution
    over the channels, or what the channel of T itself shows. Without that, no T explains a pixel that the smoke darkens
    although J is brighter than B. Only smoke in its own shadow does so. Such a pixel counts as thick as can be shown: a
    fit that starts from less thins it out until nothing is left (docs/experiments/thick-smoke.md).
    """
    shines = optics.scattering != "absorption"
    source = _in_channels(optics.unshadowed_source() if shines else np.zeros(3), image)
    contrast = background - source
    if image.shape[-1] > 3:  # shadows do not matter to the last channel
        image, contrast, source = image[..., 3:], contrast[..., 3:], source[3:]
    clear = np.sum((image - source) * contrast, -1) / np.maximum(np.sum(contrast * contrast, -1), 1e-12)
    depth = -np.log(np.clip(clear, THINNEST_CLEAR, 1.0))
    if optics.scattering in SHADOWED and image.shape[-1] == 3:
        away = np.sum((image - background) * contrast, -1)
        shaded = (away > SHADED * np.sqrt(np.sum((noise * contrast) ** 2, -1))) & mask
        # a shaded side is a patch of pixels; single ones are a codec's errors
        depth[ndimage.binary_opening(shaded, np.ones((PATCH, PATCH)))] = -np.log(THINNEST_CLEAR)
    return np.where(mask, depth, 0).astype(np.float32)


def shadowed_optical_depth(view: ObservedView, image: Image, transmittance: Array, optics: Optics) -> Array:
    """Optical depth (rows, columns) that explains a view's picture in an estimate's shadows: SHADED_DEPTH ln(1 + r).

    The estimate has the view's optical depth. ``image`` (rows, columns, channels) and ``transmittance`` (rows, columns)
    are what the view's camera sees of it before the view's background B. Its source radiance is J = (image - T B) /
    (1 - T), and r is the fraction of the contrast B - J that the view shows. If J were right the optical depth would be
    -ln(1 - r), which has no bound as r nears 1. But where the shadows fall is only assumed, so J may be off by a factor
    of two.
    """
    background, clear = view.background, transmittance[..., None]
    contrast = background - (image - clear * background) / np.maximum(1 - clear, 1e-6)
    usual = background - _in_channels(optics.unshadowed_source(), background)
    least = MIN_CONTRAST**2 * np.sum(usual * usual, -1)
    seen = np.sum((background - view.image) * contrast, -1) + least * -np.expm1(-view.optical_depth)
    fraction = seen / np.maximum(np.sum(contrast * contrast, -1) + least, 1e-12)
    # else as thick as can be shown
    known = (fraction > 0) & (view.optical_depth < -MAX_KNOWN_DEPTH * np.log(THINNEST_CLEAR))
    depth = np.where(known, SHADED_DEPTH * np.log1p(np.maximum(fraction, 0)), view.optical_depth)
    return np.where(view.mask, depth, 0).astype(np.float32)


def _faint_smoke(element: Element, clear: Mask) -> Array:
    """Probability (rows, columns) that an element shows smoke, where the opacity that is found in clear air is noise.

    Smoke of the plate's own brightness hardly changes the picture, but it hides the plate's detail. So does a codec, a
    little, in patches of any size.
    """
    if not clear.any():
        return np.ones(clear.shape, np.float32)
    opacity = 1 - element.transmittance
    noise = max(float(np.quantile(opacity[clear], CLEAR_QUANTILE)), MIN_OPACITY_NOISE) / CLEAR_DEVIATIONS
    return certainty(opacity / np.float32(noise), OPACITY_WIDTH, element.shared / np.float32(noise))


def _over_one_color(observation: Observation, element: Element, plate: Plate) -> tuple[Image, Image, Image]:
    """An element, its background and its noise in four channels: over the plate's mean color, and T over a white.

    So a fit asks for S + T B, which the picture shows best, before a plate without detail, and for T. The white is as
    bright beside the plate and the smoke as `WHITE` says, less where T is uncertain, and where the light is assumed
    less where S is unlike what that much smoke usually sends: that may be a person. Errors of T are no noise, whatever
    their size: they do not end a fit.
    """
    known = np.broadcast_to(plate.confidence[..., None] + MIN_WEIGHT, plate.image.shape)
    color = np.average(plate.image, axis=(0, 1), weights=known)
    opacity, sent = 1 - element.transmittance, np.maximum(channel_mean(element.radiance), 0)
    brightness = max(float((opacity * sent).sum()) / max(float(opacity.sum()), MIN_WEIGHT), float(color.mean()))
    useful = np.hypot(1, element.deviation / USEFUL_DEVIATION)
    if observation.light_assumed:
        usual = opacity * (float(sent.sum()) / max(float(opacity.sum()), MIN_WEIGHT))
        least = max(MIN_SENT * brightness, MIN_WEIGHT)
        unlike = np.log((sent + least) / (usual + least)) / (2 * BRIGHTNESS_RANGE)
        white = WHITE_IN_ASSUMED_LIGHT * brightness / np.hypot(useful, unlike)
    else:
        white = WHITE * brightness / useful
    noise = noise_at(observation.image, plate)
    image = np.dstack([element.over(color), white * element.transmittance])
    background = np.dstack([np.broadcast_to(color, noise.shape), white])
    return image.astype(np.float32), background.astype(np.float32), np.dstack([noise, noise.mean(-1)])


def _in_channels(source: Doubles, picture: Image) -> Doubles:
    """A radiance (3,) of smoke in a picture's channels: what is beyond the colors shows none."""
    return np.pad(source, (0, picture.shape[-1] - len(source)))


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
