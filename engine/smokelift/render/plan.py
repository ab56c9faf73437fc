"""What stays the same from picture to picture: a camera and lights, in coordinates of the voxels that are rendered."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Doubles
from smokelift.render.camera_rays import Rays
from smokelift.render.light_sweeps import Shape, Sweep, Voxel
from smokelift.scene import Camera, Domain, Medium


@dataclass(frozen=True, eq=False)
class RenderPlan:
    """One camera before one grid: the box around the voxels that may hold smoke."""

    domain: Domain
    """The whole domain."""
    corner: Voxel
    """First voxel of the box."""
    marked: NDArray[np.uint8]
    """(x, y, z) uint8: the voxels of the box that may hold smoke."""
    medium: Medium
    """Extinction, albedo, anisotropy."""
    rays: Rays
    """Of the camera, through the box."""
    to_eye: NDArray[np.float64]
    """(3, 4): affine map from a voxel's index in the box to the direction from there to the eye, of any length."""
    lights: tuple[Sweep, ...]
    """In coordinates of the box, in the smoke's color."""
    color: Doubles
    """(channels, 3): color of the radiance in each channel. Without channels the smoke only absorbs."""
    shadows: bool
    """Whether light is attenuated on its way to the voxels."""
    diffuse: bool
    """Whether scattered light is scattered again."""

    @property
    def shape(self) -> Shape:
        """Voxels of the box."""
        x, y, z = self.marked.shape
        return x, y, z

    @property
    def channels(self) -> int:
        """How many channels of in-scattered radiance there are: 0, 1 or 3."""
        return len(self.color)

    @property
    def box(self) -> tuple[slice, slice, slice]:
        """Where the box lies in the domain."""
        x, y, z = (slice(first, first + count) for first, count in zip(self.corner, self.shape, strict=True))
        return x, y, z


def to_eye(camera: Camera, domain: Domain) -> NDArray[np.float64]:
    """Return the affine map `RenderPlan.to_eye` for the voxels of a domain."""
    matrix = np.array(camera.matrix, np.float64)
    affine = np.zeros((3, 4))
    if camera.type == "orthographic":
        affine[:, 3] = matrix[:3, 2]
        return affine
    h = domain.voxel_size
    affine[:, :3] = -h * np.eye(3)
    affine[:, 3] = matrix[:3, 3] - (np.array(domain.min) + 0.5 * h)
    return affine
