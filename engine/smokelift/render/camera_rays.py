"""Camera rays in grid coordinates.

Every ray is sampled where it crosses the planes of voxel centres of its own dominant axis, so a sample needs a
bilinear look-up in one plane, and the position in the plane is linear in the plane's number:

    position_b(k) = start_b + slope_b k,   |slope_b| <= 1.

The distance between samples is between one voxel edge and sqrt(3) of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from smokelift.checks.array_types import Doubles
from smokelift.scene import Camera, Domain
from smokelift.scene.projection import ray_through_pixels, world_to_pixel

LATERAL = ((1, 2), (0, 2), (0, 1))
"""The two other axes of each axis."""

MIN_SLOPE = 1e-9
"""Voxels a plane. Rays of less slope stay in one column of voxels, and dividing by this instead loses nothing."""


@dataclass(frozen=True, eq=False)
class Rays:
    """One ray a pixel, for one grid.

    Attributes
    ----------
    lines : (rows, columns, 4) float32
        start_b, slope_b, start_c, slope_c in voxel units, voxel centres at integers.
    length : (rows, columns) float32
        Distance between samples, m.
    planes : (rows, columns, 4) int32
        Dominant axis; +1 or -1, the direction of travel along it; first and last plane in ascending order
        (last < first: the ray misses the grid).
    axes
        The dominant axes that occur.
    to_pixel : (3, 4) float64
        Homogeneous map from grid coordinates to pixel x, pixel y (both times depth), depth. Depth is 1 for an
        orthographic camera.
    """

    lines: NDArray[np.float32]
    length: NDArray[np.float32]
    planes: NDArray[np.int32]
    axes: tuple[int, ...]
    to_pixel: Doubles


@lru_cache(maxsize=32)
def camera_rays(camera: Camera, domain: Domain) -> Rays:
    """The rays of all pixels of a camera through a domain's grid."""
    origin, direction = ray_through_pixels(camera)
    start = (origin - np.array(domain.min)) / domain.voxel_size - 0.5
    axis = np.argmax(np.abs(direction), axis=-1)
    lateral = np.array(LATERAL)[axis]
    along = np.take_along_axis(direction, axis[..., None], -1)
    slope = np.take_along_axis(direction, lateral, -1) / along
    start_along = np.take_along_axis(start, axis[..., None], -1)
    offset = np.take_along_axis(start, lateral, -1) - slope * start_along
    resolution = np.array(domain.resolution)
    first, last = _plane_range(offset, slope, resolution[lateral], resolution[axis])
    travel = np.where(along[..., 0] > 0, 1, -1)
    if camera.type == "perspective":  # nothing behind the eye
        eye = start_along[..., 0]
        first = np.where(travel > 0, np.maximum(first, np.floor(eye) + 1), first)
        last = np.where(travel < 0, np.minimum(last, np.ceil(eye) - 1), last)
    planes = np.stack([axis, travel, first, last], -1).astype(np.int32)
    hit = planes[..., 2] <= planes[..., 3]
    lines = np.stack([offset[..., 0], slope[..., 0], offset[..., 1], slope[..., 1]], -1)
    lines = np.where(hit[..., None], lines, 0.0)  # a ray that misses can pass at any distance
    to_grid = np.eye(4)
    to_grid[:3, :3] *= domain.voxel_size
    to_grid[:3, 3] = np.array(domain.min) + 0.5 * domain.voxel_size
    return Rays(
        lines=lines.astype(np.float32),
        length=(domain.voxel_size / np.abs(along[..., 0])).astype(np.float32),
        planes=planes,
        axes=tuple(int(a) for a in np.unique(axis[hit])),
        to_pixel=world_to_pixel(camera) @ to_grid,
    )


def _plane_range(
    offset: Doubles, slope: Doubles, lateral: NDArray[np.int64], count: NDArray[np.int64]
) -> tuple[Doubles, Doubles]:
    """First and last plane, in ascending order, where the bilinear footprint meets the grid.

    The footprint is open, so positions are kept a thousandth of a voxel inside (-1, n): float32 then rounds to
    the same cell everywhere.

    Parameters
    ----------
    offset, slope : (rows, columns, 2)
        Of the rays along the two other axes.
    lateral : (rows, columns, 2)
        Voxels along those.
    count : (rows, columns)
        Planes.

    Returns
    -------
    (rows, columns) each; 0 and -1 where the ray misses the grid.
    """
    low, high = -0.999 - offset, lateral - 0.001 - offset
    steep = np.where(np.abs(slope) < MIN_SLOPE, MIN_SLOPE, slope)
    one, other = low / steep, high / steep
    # a ray along the planes' axis is beside the grid in all of them or in none
    along, beside = slope == 0, (low > 0) | (high < 0)
    enter = np.where(along, np.where(beside, np.inf, -np.inf), np.minimum(one, other)).max(-1)
    leave = np.where(along, np.where(beside, -np.inf, np.inf), np.maximum(one, other)).min(-1)
    first = np.ceil(np.maximum(enter, 0))
    last = np.floor(np.minimum(leave, count - 1))
    empty = ~(first <= last)
    return np.where(empty, 0, first), np.where(empty, -1, last)
