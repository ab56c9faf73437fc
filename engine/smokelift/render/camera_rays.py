"""Camera rays in grid coordinates.

Every ray is sampled where it crosses the planes of voxel centers of its own dominant axis, so a sample needs a
bilinear look-up in one plane, and the position in the plane is linear in the plane's number:

    position_b(k) = start_b + slope_b k,   |slope_b| <= 1.

The distance between samples is between one voxel edge and sqrt(3) of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

import smokelift._core as _core
from smokelift.checks.array_types import Doubles
from smokelift.scene import Camera, Domain
from smokelift.scene.projection import world_to_pixel

LATERAL = ((1, 2), (0, 2), (0, 1))
"""The two other axes of each axis."""


@dataclass(frozen=True, eq=False)
class Rays:
    """One ray a pixel, for one grid.

    Attributes
    ----------
    lines : (rows, columns, 4) float32
        start_b, slope_b, start_c, slope_c in voxel units, voxel centers at integers.
    length : (rows, columns) float32
        Distance between samples, m.
    planes : (rows, columns, 4) int32
        Dominant axis; +1 or -1, the direction of travel along it; first and last plane in ascending order
        (last < first: the ray misses the grid).
    to_pixel : (3, 4) float64
        Homogeneous map from grid coordinates to pixel x, pixel y (both times depth), depth. Depth is 1 for an
        orthographic camera.
    """

    lines: NDArray[np.float32]
    length: NDArray[np.float32]
    planes: NDArray[np.int32]
    to_pixel: Doubles

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """The dominant axes that occur."""
        return tuple(int(axis) for axis in np.unique(self.planes[self.planes[..., 2] <= self.planes[..., 3], 0]))


@lru_cache(maxsize=32)
def camera_rays(camera: Camera, domain: Domain) -> Rays:
    """The rays of all pixels of a camera through a domain's grid."""
    width, height = camera.size
    across = (np.arange(width) + 0.5 - camera.cx) / camera.fx
    up = -(np.arange(height) + 0.5 - camera.cy) / camera.fy
    matrix = np.array(camera.matrix, np.float64)
    right, above, back, eye = matrix[:3].T
    h, far = domain.voxel_size, camera.type == "orthographic"
    start, direction = np.zeros((2, 3, 3))
    start[0], direction[0] = (eye - np.array(domain.min)) / h - 0.5, -back
    if far:
        start[1:] = right / h, above / h
    else:
        direction[1:] = right, above
    lines, length, planes = _core.pixel_rays(start, direction, far, across, up, domain.resolution)
    to_grid = np.eye(4)
    to_grid[:3, :3] *= h
    to_grid[:3, 3] = np.array(domain.min) + 0.5 * h
    return Rays(lines, length * np.float32(h), planes, world_to_pixel(camera) @ to_grid)
