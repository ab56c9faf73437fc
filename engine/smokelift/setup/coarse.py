"""A few frames of a clip at low resolution: what choices are measured on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

from smokelift.footage.clip import Clip
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plate, Plates
from smokelift.footage.working_picture import CameraError, WorkingPicture, working_picture
from smokelift.render import Image
from smokelift.scene import Camera, CompleteScene, Domain, Scattering
from smokelift.scene.projection import voxel_width

LONGEST = 32
"""Voxels along the longest side at most: a few per cent of the work of 96, with every large shadow in its place."""

FEWEST = 4
"""Voxels along the shortest side at least."""

PIXELS = 2.0
"""Pixels of the clip along a voxel at least, so that each half of them shows every voxel."""


@dataclass(frozen=True, eq=False)
class Halves:
    """A frame as two small pictures, each from the pixels of one colour of a chequerboard; made once it is asked for.

    Attributes
    ----------
    clip, number
        Where the frame is from.
    working
        The small picture.
    """

    clip: Clip
    number: int
    working: WorkingPicture

    @property
    def fitted(self) -> Image:
        """One of them, (rows, columns, 3)."""
        return self._both[0]

    @property
    def held_out(self) -> Image:
        """The other."""
        return self._both[1]

    @cached_property
    def _both(self) -> tuple[Image, Image]:
        working = self.working
        first = (working.top + working.left) % 2  # the colours are those of the whole picture's pixels
        return self.clip.chequered_averages(self.number, *working.camera.size, working.part, first)


@dataclass(frozen=True, eq=False)
class CoarseFrame:
    """One frame before a coarse grid.

    Attributes
    ----------
    scene
        With the camera of the small picture and the coarse domain.
    plate
        Of the small picture.
    picture : (rows, columns, 3)
        The small picture, linear radiance.
    halves
        The same from one half of the clip's pixels each.
    """

    scene: CompleteScene
    plate: Plate
    picture: Image
    halves: Halves

    @property
    def shows_smoke(self) -> bool:
        """Whether it does."""
        return bool(matte(self.picture, self.plate).mask.any())

    def in_light_of(self, scene: CompleteScene) -> CoarseFrame:
        """The frame with the lights of a scene."""
        return replace(self, scene=replace(self.scene, lights=scene.lights))

    def scattered_by(self, scattering: Scattering) -> CoarseFrame:
        """The frame with another model of scattering."""
        return replace(self, scene=replace(self.scene, scattering=scattering))


@dataclass(frozen=True, eq=False)
class CoarseClip:
    """A clip before coarse grids; each frame is made once.

    Attributes
    ----------
    clip
        The footage.
    scene
        With the camera of the clip's full pictures and the fine domain.
    plates
        Of the full pictures.
    """

    clip: Clip
    scene: CompleteScene
    plates: Plates

    def frame(self, number: int, times: int = 1) -> CoarseFrame | None:
        """A frame on a grid so many times finer than `LONGEST` asks for; None if it does not show the domain."""
        key = number, times
        if key not in self._frames:
            camera, plate = self.scene.camera.at(number), self.plates.at(number)
            self._frames[key] = coarse_frame(self.clip, number, camera, self.scene, plate, times * LONGEST)
        return self._frames[key]

    @cached_property
    def _frames(self) -> dict[tuple[int, int], CoarseFrame | None]:
        return {}


def coarse_domain(domain: Domain, pixels: float, most_voxels: int = LONGEST) -> Domain:
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
        if max(counts) <= most and min(counts) >= FEWEST:
            if max(counts) >= most / 2:
                return replace(domain, resolution=(counts[0], counts[1], counts[2]))
            break
    # nor so coarse that a side has less than one
    times_finer = min(max(longest / max(most, FEWEST), 1.0), min(domain.resolution))
    voxel = domain.voxel_size * times_finer
    # never beyond the box, where a light may stand
    x, y, z = (max(1, math.floor(n / times_finer + 1e-6)) for n in domain.resolution)
    return domain.about_centre((x, y, z), voxel)


def coarse_frame(
    clip: Clip, number: int, camera: Camera, scene: CompleteScene, plate: Plate, most_voxels: int = LONGEST
) -> CoarseFrame | None:
    """Make a frame coarse; None if its camera does not see the domain.

    Parameters
    ----------
    clip, number
        The frame.
    camera
        Of the full picture, where it is in this frame.
    scene
        With the fine domain.
    plate
        Of the full picture.
    most_voxels
        Along the longest side of the coarse domain, at most.
    """
    try:
        domain = coarse_domain(scene.domain, voxel_width(camera, scene.domain), most_voxels)
        working = working_picture(camera, domain)
    except CameraError:
        return None
    return CoarseFrame(
        replace(scene, camera=working.camera, domain=domain),
        plate.through(working.cut, working.pixels),
        working.of(clip, number),
        Halves(clip, number, working),
    )
