"""A few frames of a clip at low resolution: what choices are measured on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
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
"""Voxels along the longest side at most: a few per cent of the work of 96, with every large shadow in its place."""

SHORTEST = 4
"""Voxels along the shortest side at least."""

PIXELS = 2.0
"""Pixels of the clip along a voxel at least, so that each half of them shows every voxel."""


@dataclass(frozen=True, eq=False)
class CoarseView:
    """One camera's picture of one moment, at two pixels of the clip a coarse voxel at least.

    Attributes
    ----------
    camera
        Of the small picture.
    plate
        Of the small picture.
    picture : (rows, columns, 3)
        The small picture, linear radiance.
    read_halves
        Makes the same of the two colours of a chequerboard of the clip's pixels each.
    """

    camera: Camera
    plate: Plate
    picture: Image
    read_halves: Callable[[], tuple[Image, Image]]

    @property
    def fitted(self) -> Image:
        """The picture (rows, columns, 3) of one half of the clip's pixels."""
        return self._halves[0]

    @property
    def held_out(self) -> Image:
        """The picture (rows, columns, 3) of the other half."""
        return self._halves[1]

    @cached_property
    def smoke(self) -> NDArray[np.bool_]:
        """Pixels (rows, columns) that show smoke."""
        return matte(self.picture, self.plate).mask

    def over(self, gain: NDArray[np.float32]) -> CoarseView:
        """The view with its pictures and background over a gain (3,)."""
        plate = self.plate.through(lambda part: part / gain if part.ndim == 3 else part)
        return CoarseView(self.camera, plate, self.picture / gain, lambda: (self.fitted / gain, self.held_out / gain))

    @cached_property
    def _halves(self) -> tuple[Image, Image]:
        return self.read_halves()


@dataclass(frozen=True, eq=False)
class CoarseFrame:
    """One moment before a coarse grid.

    Attributes
    ----------
    scene
        With the first camera's small picture and the coarse domain.
    views
        What the cameras saw, the input's first.
    """

    scene: CompleteScene
    views: tuple[CoarseView, ...]

    @property
    def shows_smoke(self) -> bool:
        """Whether every camera does."""
        return all(bool(view.smoke.any()) for view in self.views)

    def lit_by(self, lights: tuple[Light, ...]) -> CoarseFrame:
        """The frame with other lights."""
        return replace(self, scene=replace(self.scene, lights=lights))

    def scattered_by(self, scattering: Scattering) -> CoarseFrame:
        """The frame with another model of scattering."""
        return replace(self, scene=replace(self.scene, scattering=scattering))


@dataclass(frozen=True, eq=False)
class CoarseClip:
    """A clip before coarse grids; each frame is made once.

    Attributes
    ----------
    views
        The cameras, the input first.
    scene
        With the camera of the clip's full pictures and the fine domain.
    """

    views: Sequence[ShotView]
    scene: CompleteScene
    _frames: dict[tuple[int, int], CoarseFrame | None] = field(default_factory=dict)

    def frame(self, number: int, times: int = 1) -> CoarseFrame | None:
        """A frame on a grid so many times finer than `COARSE_SIDE` asks for; None if it does not show the domain."""
        key = number, times
        if key not in self._frames:
            self._frames[key] = coarse_frame(self.views, number, self.scene, times * COARSE_SIDE)
        return self._frames[key]

    def smoky(self, numbers: Sequence[int]) -> dict[int, CoarseFrame]:
        """Frames of the given numbers that show smoke, by number."""
        frames = {number: self.frame(number) for number in numbers}
        return {number: frame for number, frame in frames.items() if frame is not None and frame.shows_smoke}


def coarse_domain(domain: Domain, pixels: float, most_voxels: int = COARSE_SIDE) -> Domain:
    """The box with fewer voxels: a whole number of fine ones in each if that is possible, else a little less of it.

    Parameters
    ----------
    domain
        The box with its own voxels.
    pixels
        Pixels of the clip along one of them.
    most_voxels
        Voxels along the longest side at most.
    """
    longest = max(domain.resolution)
    most = min(most_voxels, int(longest * pixels / PIXELS))
    common = math.gcd(*domain.resolution)
    for times in (n for n in range(1, common + 1) if common % n == 0):
        counts = [n // times for n in domain.resolution]
        if max(counts) <= most and min(counts) >= SHORTEST:
            if max(counts) >= most / 2:
                return replace(domain, resolution=(counts[0], counts[1], counts[2]))
            break
    # nor so coarse that a side has less than one
    times_finer = min(max(longest / max(most, SHORTEST), 1.0), min(domain.resolution))
    voxel = domain.voxel_size * times_finer
    # never beyond the box, where a light may stand
    x, y, z = (max(1, math.floor(n / times_finer + 1e-6)) for n in domain.resolution)
    return domain.about_centre((x, y, z), voxel)


def coarse_frame(
    views: Sequence[ShotView], number: int, scene: CompleteScene, most_voxels: int = COARSE_SIDE
) -> CoarseFrame | None:
    """Make a frame coarse; None if one of the cameras does not see the domain.

    Parameters
    ----------
    views
        The cameras, the input first.
    number
        Of the frame.
    scene
        With the fine domain.
    most_voxels
        Along the longest side of the coarse domain, at most.
    """
    try:
        domain = coarse_domain(scene.domain, voxel_width(views[0].camera.at(number), scene.domain), most_voxels)
        seen = tuple(_coarse_view(view, number, domain) for view in views)
    except CameraError:
        return None
    return CoarseFrame(replace(scene, camera=seen[0].camera, domain=domain), seen)


def _coarse_view(view: ShotView, number: int, domain: Domain) -> CoarseView:
    """What one camera saw of a frame."""
    working = working_picture(view.camera.at(number), domain)
    first = (working.top + working.left) % 2  # the colours are those of the whole picture's pixels

    def halves() -> tuple[Image, Image]:
        return chequered_averages(view.clip.stored(number).cut(working.part), *working.camera.size, first)

    plate = view.plates.at(number).through(working.cut, working.pixels)
    return CoarseView(working.camera, plate, working.of(view.clip, number), halves)
