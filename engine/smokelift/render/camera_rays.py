"""Camera rays in grid coordinates.

Every ray is sampled where it crosses the planes of voxel centers of its own dominant axis, so a sample needs a
bilinear look-up in one plane, and the position in the plane is linear in the plane's number:

    position_b(k) = start_b + slope_b k,   |slope_b| <= 1.

The distance between samples is between one voxel edge and sqrt(3) of it.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Array, Doubles
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import world_to_pixel
from smokelift.scene.domain import LATERAL

INSIDE = 1e-3
"""The footprint is open, so places are kept so many voxels inside: floats then round to the same cell everywhere."""

MIN_SLOPE = 1e-9
"""Voxels per plane. Rays of less slope stay in one column of voxels, and dividing by this loses nothing."""

BAND = 1 << 14
"""Pixels whose rays are found together, about: what lies between fits into a cache."""


@dataclass(frozen=True, eq=False)
class Rays:
    """One ray per pixel, for one grid."""

    lines: NDArray[np.float32]
    """(rows, columns, 4) float32: start_b, slope_b, start_c, slope_c in voxel units, voxel centers at integers."""
    length: NDArray[np.float32]
    """(rows, columns) float32: distance between samples, m."""
    planes: NDArray[np.int32]
    """(rows, columns, 4) int32: dominant axis; +1 or -1, the direction of travel along it; first and last plane in
    ascending order (last < first: the ray misses the grid)."""
    to_pixel: Doubles
    """(3, 4) float64: homogeneous map from grid coordinates to pixel x, pixel y (both times depth), depth. Depth is 1
    for an orthographic camera."""

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
    h = domain.voxel_size
    bands = np.array_split(up, math.ceil(width * height / BAND))
    found = [_band(camera, domain, across, band) for band in bands]
    lines, length, planes = (np.concatenate(parts) for parts in zip(*found, strict=True))
    to_grid = np.eye(4)
    to_grid[:3, :3] *= h
    to_grid[:3, 3] = np.array(domain.min) + 0.5 * h
    return Rays(lines, length * np.float32(h), planes, world_to_pixel(camera) @ to_grid)


def _band(camera: Camera, domain: Domain, across: Doubles, up: Doubles) -> tuple[Array, Array, NDArray[np.int32]]:
    """Lines, lengths in voxels and planes of the rays of some rows, by the places of columns and rows in the picture.

    Samples lie where the bilinear footprint meets the grid, and before the eye unless the camera is far away.
    """
    right, above, back, eye = np.array(camera.matrix, np.float64)[:3].T
    h, far = domain.voxel_size, camera.type == "orthographic"
    start, direction = (eye - np.array(domain.min)) / h - 0.5, -back
    shift = across[:, None] * right + up[:, None, None] * above
    start, direction = np.broadcast_arrays(*((start + shift / h, direction) if far else (start, direction + shift)))
    axis = np.argmax(np.abs(direction), axis=-1)
    order = np.array([(along, *LATERAL[along]) for along in range(3)])[axis]  # the dominant axis and the two others
    start, direction = (np.take_along_axis(vectors, order, -1) for vectors in (start, direction))
    count = np.array(domain.resolution)[order]
    along = direction[..., 0]
    lines, first, last = [], np.zeros(along.shape), count[..., 0] - 1.0
    for lateral in (1, 2):
        slope = direction[..., lateral] / along
        offset = start[..., lateral] - slope * start[..., 0]
        steep = np.where(np.abs(slope) < MIN_SLOPE, MIN_SLOPE, slope)
        ends = (INSIDE - 1 - offset) / steep, (count[..., lateral] - INSIDE - offset) / steep
        first, last = np.maximum(first, np.minimum(*ends)), np.minimum(last, np.maximum(*ends))
        lines += [offset, slope]
    first, last = np.ceil(first), np.floor(last)
    if not far:  # nothing behind the eye
        first = np.where(along > 0, np.maximum(first, np.floor(start[..., 0]) + 1), first)
        last = np.where(along < 0, np.minimum(last, np.ceil(start[..., 0]) - 1), last)
    hits = first <= last
    # a ray that misses can pass at any distance
    crossings = np.where(hits[..., None], np.stack(lines, -1), 0)
    length = np.linalg.norm(direction, axis=-1) / np.abs(along)
    planes = [axis, np.where(along > 0, 1, -1), np.where(hits, first, 0), np.where(hits, last, -1)]
    return crossings.astype(np.float32), length.astype(np.float32), np.stack(planes, -1).astype(np.int32)
