"""How OpenVDB files are written for the program that reads them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from smokelift.scene import Domain
from smokelift.transport import Array

HostName = Literal["blender", "houdini", "unreal"]

Axes = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]


@dataclass(frozen=True)
class Host:
    """What a program expects."""

    velocity: str = "velocity"
    """Name of the grid of the velocity."""
    up_axis: str = "Z"
    """``"Z"`` or ``"Y"``."""
    axes: Axes = ((0, 1), (1, 1), (2, 1))
    """For each of the program's axes ours, and 1, or -1 where it points the other way."""
    left_handed: bool = False
    """Whether these axes mirror the smoke."""
    eight_bits: bool = False
    """Whether it keeps densities from 0 to 1 in 8 bits: they are divided by the largest of the sequence."""
    whole_box: bool = False
    """Whether it puts the pivot at the corner of what is active: then the box's corners are, in every frame."""

    def box(self, domain: Domain) -> Domain:
        """The box of the smoke in the program's axes."""
        ends = [sorted((sign * domain.min[axis], sign * domain.max[axis])) for axis, sign in self.axes]
        (x0, x1), (y0, y1), (z0, z1) = ends
        nx, ny, nz = (domain.resolution[axis] for axis, _ in self.axes)
        return Domain((x0, y0, z0), (x1, y1, z1), (nx, ny, nz))

    def turned(self, values: Array) -> Array:
        """A volume, or the vectors of one (x, y, z, 3), in the program's axes."""
        order = [axis for axis, _ in self.axes]
        turned = values.transpose(*order, *range(3, values.ndim))
        turned = turned[tuple(slice(None, None, sign) for _, sign in self.axes)]
        return (
            turned if values.ndim == 3 else turned[..., order] * np.array([sign for _, sign in self.axes], np.float32)
        )


BLENDER = Host()

HOSTS: Mapping[HostName, Host] = {
    "blender": BLENDER,
    "houdini": Host(velocity="vel", up_axis="Y", axes=((0, 1), (2, 1), (1, -1))),
    "unreal": Host(axes=((0, 1), (1, -1), (2, 1)), left_handed=True, eight_bits=True, whole_box=True),
}
"""Hosts by the name of the program. Unreal's importer (5.4) takes voxels for those of its left-handed axes, the corner
of the box around all active voxels of a sequence for the pivot, and a grid ``density`` for 8 bits from 0 to 1 (by
definition)."""
