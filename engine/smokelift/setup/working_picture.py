"""The working picture: a frame cropped to the domain and reduced to about one pixel per voxel."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import project_points, voxel_width


@dataclass(frozen=True)
class WorkingPicture:
    """The part of a camera's picture that the domain covers, at the grid's resolution.

    ``camera`` is that of the working picture; the other attributes are its place in the full picture, in full pixels.
    """

    camera: Camera
    left: int
    top: int
    width: int
    height: int

    @property
    def pixels(self) -> float:
        """Number of full pixels that each small one is the mean of."""
        columns, rows = self.camera.size
        return self.width * self.height / (columns * rows)

    def resized(self, columns: int, rows: int) -> "WorkingPicture":
        """Return the same part at another number of pixels."""
        return replace(self, camera=self.camera.resized(columns, rows))

    def part(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the part of a full picture (rows, columns, ...) at its own resolution."""
        return picture[self.top : self.top + self.height, self.left : self.left + self.width]

    def cut(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the working picture of a full one (rows, columns, ...)."""
        columns, rows = self.camera.size
        return area_average(self.part(picture), columns, rows)

    def of(self, clip: Clip, number: int) -> Picture:
        """Return the working picture of a clip's frame."""
        return clip.stored(number).cut(self.part).averaged(*self.camera.size)


class CameraError(ValueError):
    """A camera that does not see the domain."""


def working_picture(camera: Camera, domain: Domain) -> WorkingPicture:
    """Return the picture that a grid is fitted to.

    A pixel is as wide as a voxel at the domain's center, unless the footage is coarser: finer pixels hold detail that
    the grid cannot show, coarser ones lose detail that it can. CameraError is raised if the picture shows no part of
    the domain.
    """
    pixels, depth = project_points(camera, domain.corners())
    width, height = camera.size
    low, high = np.zeros(2), np.array([width, height], np.float64)
    if (depth > 0).all():
        low, high = np.maximum(pixels.min(0), low), np.minimum(pixels.max(0), high)
    if (depth <= 0).all() or (high - low < 1).any():
        raise CameraError("The camera does not see the domain; move the domain into the picture or turn the camera.")
    left, top = (int(v) for v in np.floor(low))
    right, bottom = (int(v) for v in np.ceil(high))
    shrink = max(1.0, voxel_width(camera, domain))
    columns = max(1, round((right - left) / shrink))
    rows = max(1, round((bottom - top) / shrink))
    small = camera.cropped(left, top, right - left, bottom - top).resized(columns, rows)
    return WorkingPicture(small, left, top, right - left, bottom - top)
