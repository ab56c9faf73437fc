"""What stays the same from picture to picture: a camera and lights, in coordinates of the voxels that are rendered."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Doubles
from smokelift.render.camera_rays import Rays, camera_rays
from smokelift.render.light_sweeps import Shape, Sweep, Voxel, light_sweeps
from smokelift.scene import SHADOWED, Camera, Domain, FiniteLight, Medium, Scattering
from smokelift.scene.domain import box_around


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


def plan_render(
    camera: Camera,
    domain: Domain,
    medium: Medium,
    lights: Sequence[FiniteLight],
    scattering: Scattering,
    support: NDArray[np.bool_] | None,
) -> RenderPlan:
    """Plan the rendering for a camera; `smokelift.render.Renderer` says what the parameters are."""
    if scattering not in get_args(Scattering):
        raise ValueError(f"scattering must be one of {', '.join(get_args(Scattering))}, not {scattering!r}.")
    if scattering == "multiple" and medium.anisotropy != 0.0:
        raise ValueError(
            f'Scattering "multiple" needs anisotropy 0, not {medium.anisotropy:g}; take scattering "single", or smoke '
            "that scatters alike in all directions."
        )
    if support is None:
        support = np.broadcast_to(np.True_, domain.resolution)
    # with the neighbors of the voxels that may hold smoke; one voxel if none may
    x, y, z = part = box_around(support, 1) if support.any() else (slice(0, 1),) * 3
    corner, box = (x.start, y.start, z.start), domain.part(part)
    scatters = () if scattering == "absorption" else lights
    # light that is scattered again takes on more of the smoke's color
    split = scattering == "multiple" and not medium.is_gray
    sweeps, color = light_sweeps(scatters, domain, corner, box.resolution, medium.color, split)
    return RenderPlan(
        domain=domain,
        corner=corner,
        marked=support[part].astype(np.uint8),
        medium=medium,
        rays=camera_rays(camera, box),
        to_eye=_to_eye(camera, box),
        lights=sweeps,
        color=color,
        shadows=scattering in SHADOWED and len(color) > 0,
        diffuse=scattering == "multiple" and len(color) > 0,
    )


def _to_eye(camera: Camera, domain: Domain) -> NDArray[np.float64]:
    matrix = np.array(camera.matrix, np.float64)
    affine = np.zeros((3, 4))
    if camera.type == "orthographic":
        affine[:, 3] = matrix[:3, 2]
        return affine
    h = domain.voxel_size
    affine[:, :3] = -h * np.eye(3)
    affine[:, 3] = matrix[:3, 3] - (np.array(domain.min) + 0.5 * h)
    return affine
