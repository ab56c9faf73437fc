"""A few frames of a clip at low resolution, and the one judge of lights and scattering on them.

A wrong light can reproduce its own picture: before black, unshadowed smoke fits any picture by being too thin in
shadow. So densities are fitted to one color of a chequerboard of the clip's pixels and judged on the other. What they
let through of the background is subtracted there; the rest is light that the smoke scatters. How strong the lights have
to be for it is the least-squares factor, zero at least.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from smokelift.checks import Array, Doubles, Mask
from smokelift.density import DensitySettings, Observation, reconstruct_density
from smokelift.density.hull import project_voxels, reached
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate
from smokelift.footage.images import area_average
from smokelift.render import Image, Optics, scene_optics
from smokelift.scene import Camera, CompleteScene, Domain, Scattering
from smokelift.scene.camera import voxel_width
from smokelift.setup.geometry import proportional, working_picture
from smokelift.setup.shot import ShotView

COARSE_SIDE = 32
"""Largest number of voxels along the longest side: a few per cent of the work of 96, and every large shadow is there
(docs/experiments/scattering.md)."""

MIN_SIDE_VOXELS = 4
"""Smallest number of voxels along the shortest side: two are not at its ends."""

MIN_VOXEL_PIXELS = 2.0
"""Smallest number of the clip's pixels along a voxel: each half of the chequerboard shows every voxel."""

CELLS_PER_PIXEL = 3
"""Cells of the extraction along a coarse pixel: about as many as a fit at full resolution has."""

SCATTERING_TOLERANCE = 0.02
"""Error, as a fraction of what the smoke changes in the picture, that a cheaper model of scattering may add. Without
shadows that is reached at an optical depth of about 0.15, where the mass comes out 5 % too small
(docs/experiments/scattering.md)."""

MIN_CHANNEL_POWER = 1e-3
"""Power of a channel's light over the brightest one's, below which 8 bits lose it: it gets no strength of its own."""


@dataclass(frozen=True, eq=False)
class CoarseView:
    """One camera's small picture of one moment, with its camera and plate.

    ``picture``, ``fitted`` and ``held_out`` (rows, columns, 3) are linear radiance: of all pixels of the clip, and of
    either color of their chequerboard. Before a picture the smoke is shown before its mean color instead.
    """

    camera: Camera
    plate: Plate
    picture: Image
    fitted: Image
    held_out: Image

    @cached_property
    def smoke(self) -> Mask:
        """Pixels (rows, columns) that show smoke."""
        return matte(self.picture, self.plate).mask

    def divided(self, gain: Array) -> "CoarseView":
        """The view with its pictures and background divided by a gain (3,)."""
        plate = self.plate.through(lambda part: part / gain if part.ndim == 3 else part)
        return CoarseView(self.camera, plate, self.picture / gain, self.fitted / gain, self.held_out / gain)


@dataclass(frozen=True, eq=False)
class CoarseFrame:
    """One frame on a coarse grid.

    ``scene`` has the coarse domain and the camera of the input's small picture. ``views`` has the input first.
    """

    number: int
    scene: CompleteScene
    views: tuple[CoarseView, ...]


def coarse_frames(views: Sequence[ShotView], numbers: Sequence[int], scene: CompleteScene) -> tuple[CoarseFrame, ...]:
    """Return those of some frames in which every camera shows smoke, coarse as by `coarse_frame`."""
    frames = (coarse_frame(views, number, scene) for number in numbers)
    return tuple(frame for frame in frames if frame is not None and all(view.smoke.any() for view in frame.views))


def coarse_frame(views: Sequence[ShotView], number: int, scene: CompleteScene, times: int = 1) -> CoarseFrame | None:
    """Make a frame coarse; None if a camera does not see the domain.

    The grid has at most ``times`` `COARSE_SIDE` voxels along its longest side. The first view is the input.
    """
    pixels = voxel_width(views[0].camera.at(number), scene.domain)
    domain = coarse_domain(scene.domain, pixels, times * COARSE_SIDE)
    seen = tuple(found for view in views if (found := _coarse_view(view, number, domain)) is not None)
    if len(seen) < len(views):
        return None
    return CoarseFrame(number, replace(scene, camera=seen[0].camera, domain=domain), seen)


def coarse_domain(domain: Domain, pixels: float, most_voxels: int) -> Domain:
    """Return a box with at most ``most_voxels`` along its longest side, where a fine voxel is ``pixels`` wide.

    Each coarse voxel holds a whole number of fine ones if possible; else the box loses a little of its size.
    """
    longest = max(domain.resolution)
    most = min(most_voxels, int(longest * pixels / MIN_VOXEL_PIXELS))
    for shape in reversed(proportional(domain.resolution, max(-(-most // 2), 1), most)):
        if longest % max(shape) == 0 and min(shape) >= MIN_SIDE_VOXELS:
            return replace(domain, resolution=shape)
    return domain.with_at_most(max(most, MIN_SIDE_VOXELS))


def _coarse_view(view: ShotView, number: int, domain: Domain) -> CoarseView | None:
    """What one camera saw of a frame; None if that does not show the domain."""
    working = working_picture(view.camera.at(number), domain)
    if working is None:
        return None
    first = (working.top + working.left) % 2  # the colors are those of the whole picture's pixels
    halves = chequered(view.clip.stored(number).cut(working.part).linear(), *working.camera.size, first)
    plate = view.plate.at(number).through(working.cut, working.pixels)
    pictures = (working.of(view.clip, number), *halves)
    columns, rows = working.camera.size
    element = view.element(number, working.resized(CELLS_PER_PIXEL * columns, CELLS_PER_PIXEL * rows))
    if element is None:
        return CoarseView(working.camera, plate, *pictures)
    # before one color the plate's detail is not taken for smoke, whatever the model
    color = plate.image.mean((0, 1))
    detail = area_average(element.transmittance, columns, rows)[..., None] * (plate.image - color)
    even = replace(plate, image=np.broadcast_to(color, plate.image.shape).copy())
    return CoarseView(working.camera, even, *(picture - detail for picture in pictures))


def chequered(picture: Image, width: int, height: int, first: int) -> tuple[Image, Image]:
    """Return two means of a picture (rows, columns, 3) at a size, one of either color's pixels of a chequerboard.

    ``first`` is 0 if the top left pixel belongs to the first picture, 1 if to the second.
    """
    board = np.add.outer(*map(np.arange, picture.shape[:2])) % 2 == first

    def average(part: Mask) -> Image:
        filled = np.maximum(area_average(part, width, height), np.float32(1e-6))
        return np.asarray(area_average(np.where(part[..., None], picture, 0), width, height) / filled[..., None])

    return average(board), average(~board)


@dataclass(frozen=True)
class HeldOut:
    """How densities compare with the half of the pixels that they were not fitted to."""

    error: float
    """Root mean square difference, as a fraction of what the smoke changes there; of several cameras that of theirs."""
    gains: Doubles = field(default_factory=lambda: np.ones((1, 3)))
    """(cameras, 3): strength of the light, in multiples of the scene's, that fits best with the same densities, by
    camera and channel: more than 1 where they are too dark. 1 without scattered light."""


def held_out(frames: Sequence[CoarseFrame], model: Scattering, judge: Scattering, settings: DensitySettings) -> HeldOut:
    """Fit densities by one model to half of all cameras' pixels; compare them by the judge's model with the other half.

    Only pixels that the smoke's voxels can change count.
    """
    pixels: list[list[Doubles]] = [[] for _ in frames[0].views]
    for frame in frames:
        scene = replace(frame.scene, scattering=model)
        own, *others = (Observation(view.camera, view.fitted, view.plate) for view in frame.views)
        fitted = reconstruct_density(own.image, scene, settings=settings, plate=own.plate, views=others)
        clear = Optics(scene.domain, scene.medium, (), "absorption")
        lit = replace(scene_optics(scene), scattering=judge)
        for view, of_camera in zip(frame.views, pixels, strict=True):
            behind, shown = (
                optics.renderer(view.camera, picture, fitted.hull).image(fitted.density)
                for optics, picture in ((clear, view.plate.image), (lit, np.zeros(3, np.float32)))
            )
            reach = reached(view.smoke, project_voxels(view.camera, scene.domain))
            parts = shown, view.held_out - behind, view.held_out - view.plate.image
            of_camera.append(np.stack([part[reach].astype(np.float64) for part in parts]))
    # by camera and channel: squares of the light that is shown, and its products with what is seen
    power, product, wrong, contrast = (np.zeros((len(pixels), 3)) for _ in range(4))
    for camera, parts_of in enumerate(pixels):
        shown, seen, changed = np.concatenate(parts_of, 1)
        power[camera], product[camera] = np.sum(shown**2, 0), np.sum(shown * seen, 0)
        wrong[camera], contrast[camera] = np.sum((shown - seen) ** 2, 0), np.sum(changed**2, 0)
    error = float(np.sqrt(np.mean(wrong.sum(1) / np.maximum(contrast.sum(1), 1e-30))))
    if not power.sum() > 0:
        return HeldOut(error, np.ones_like(power))
    whole = np.maximum(product.sum(1, keepdims=True) / np.maximum(power.sum(1, keepdims=True), 1e-30), 0)
    bright = power > MIN_CHANNEL_POWER * power.max(1, keepdims=True)
    gains = np.where(bright, np.maximum(product, 0) / np.maximum(power, 1e-30), whole)
    return HeldOut(error, gains)
