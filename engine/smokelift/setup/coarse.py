"""A few frames of a clip at low resolution: what the light is judged on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.matte import matte
from smokelift.footage.plate import Plate
from smokelift.footage.stored_picture import chequered_averages
from smokelift.footage.working_picture import CameraError, working_picture
from smokelift.render import Image
from smokelift.scene import Camera, CompleteScene, Domain, Light, Scattering
from smokelift.scene.projection import voxel_width
from smokelift.setup.shot import ShotView

COARSE_SIDE = 32
"""Voxels along the longest side at most: a few per cent of the work of 96, with every large shadow in its place
(docs/experiments/scattering-selection.md)."""

SHORTEST = 4
"""Voxels along the shortest side at least."""

PIXELS = 2.0
"""Pixels of the clip along a voxel at least, so that each half of them shows every voxel."""


@dataclass(frozen=True, eq=False)
class CoarseView:
    """One camera's picture of one moment, at two pixels of the clip a coarse voxel at least.

    Attributes
    ----------
    camera, plate
        Of the small picture.
    picture, fitted, held_out : (rows, columns, 3)
        The small picture, linear radiance; and the same of either colour of a chequerboard of the clip's pixels.
    """

    camera: Camera
    plate: Plate
    picture: Image
    fitted: Image
    held_out: Image

    @cached_property
    def smoke(self) -> NDArray[np.bool_]:
        """Pixels (rows, columns) that show smoke."""
        return matte(self.picture, self.plate).mask

    def over(self, gain: NDArray[np.float32]) -> CoarseView:
        """The view with its pictures and background over a gain (3,)."""
        plate = self.plate.through(lambda part: part / gain if part.ndim == 3 else part)
        return CoarseView(self.camera, plate, self.picture / gain, self.fitted / gain, self.held_out / gain)


@dataclass(frozen=True, eq=False)
class CoarseFrame:
    """One moment before a coarse grid.

    Attributes
    ----------
    number
        Of the frame.
    scene
        With the first camera's small picture and the coarse domain.
    views
        What the cameras saw, the input's first.
    """

    number: int
    scene: CompleteScene
    views: tuple[CoarseView, ...]

    def lit_by(self, lights: tuple[Light, ...]) -> CoarseFrame:
        """The frame with other lights."""
        return replace(self, scene=replace(self.scene, lights=lights))

    def scattered_by(self, scattering: Scattering) -> CoarseFrame:
        """The frame with another model of scattering."""
        return replace(self, scene=replace(self.scene, scattering=scattering))


def coarse_frames(views: Sequence[ShotView], numbers: Sequence[int], scene: CompleteScene) -> tuple[CoarseFrame, ...]:
    """Return those of some frames in which every camera shows smoke; see `coarse_frame`."""
    frames = (coarse_frame(views, number, scene) for number in numbers)
    return tuple(frame for frame in frames if frame is not None and all(view.smoke.any() for view in frame.views))


def coarse_frame(views: Sequence[ShotView], number: int, scene: CompleteScene, times: int = 1) -> CoarseFrame | None:
    """Make a frame coarse, on a grid so many times finer than `COARSE_SIDE` asks for.

    None if one of the cameras, of which the input is the first, does not see the domain.
    """
    try:
        pixels = voxel_width(views[0].camera.at(number), scene.domain)
        domain = coarse_domain(scene.domain, pixels, times * COARSE_SIDE)
        seen = tuple(_coarse_view(view, number, domain) for view in views)
    except CameraError:
        return None
    return CoarseFrame(number, replace(scene, camera=seen[0].camera, domain=domain), seen)


def coarse_domain(domain: Domain, pixels: float, most_voxels: int) -> Domain:
    """Return the box with fewer voxels: a whole number of fine ones in each if possible, else a little less of it.

    Of the fine ones each is so many pixels of the clip wide; ``most_voxels`` lie along the longest side.
    """
    longest = max(domain.resolution)
    most = min(most_voxels, int(longest * pixels / PIXELS))
    common = math.gcd(*domain.resolution)
    for times in (n for n in range(1, common + 1) if common % n == 0):
        x, y, z = (n // times for n in domain.resolution)
        if most / 2 <= max(x, y, z) <= most and min(x, y, z) >= SHORTEST:
            return replace(domain, resolution=(x, y, z))
    # nor so coarse that a side has less than one
    times_finer = min(max(longest / max(most, SHORTEST), 1.0), min(domain.resolution))
    # never beyond the box, where a light may stand
    x, y, z = (max(1, math.floor(n / times_finer + 1e-6)) for n in domain.resolution)
    return domain.about_centre((x, y, z), domain.voxel_size * times_finer)


def _coarse_view(view: ShotView, number: int, domain: Domain) -> CoarseView:
    """What one camera saw of a frame."""
    working = working_picture(view.camera.at(number), domain)
    first = (working.top + working.left) % 2  # the colours are those of the whole picture's pixels
    halves = chequered_averages(view.clip.stored(number).cut(working.part), *working.camera.size, first)
    plate = view.plates.at(number).through(working.cut, working.pixels)
    return CoarseView(working.camera, plate, working.of(view.clip, number), *halves)
