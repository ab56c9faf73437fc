"""The upright plane through the domain's center: one picture's rows as heights in the world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.scene import Camera, Domain
from smokelift.scene.projection import project_points, ray_through_pixels

TINY = np.finfo(np.float64).tiny
"""Smallest normal number, for divisions."""

MIN_ALONG = 1e-3
"""Smallest cosine between a ray and the depth: a ray across it meets no depth."""


def view_frame(camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Lateral, depth and height directions (unit, world) in which one picture is understood.

    Height is the world's Z, because smoke rises. It is the camera's up direction if the camera looks over 45 degrees up
    or down: then that is the better row of the picture.
    """
    matrix = np.array(camera.matrix, np.float64)
    height = np.array([0.0, 0.0, 1.0])
    if abs(matrix[2, 2]) > np.sqrt(0.5):
        height = matrix[:3, 1]
    depth = -matrix[:3, 2] + (matrix[:3, 2] @ height) * height
    depth /= np.linalg.norm(depth)
    return np.cross(depth, height), depth, height


class PlaneRays(NamedTuple):
    """Where the rays of pixels meet the domain (rows, columns), by depth: meters behind its center.

    A ray enters at `near` and leaves at `far`, both 0 where `missed` marks that it does not meet the domain. Over the
    center's depth it is at `height` and `lateral`, and each changes by `rise` and `drift` a meter of depth.
    """

    near: NDArray[np.float64]
    far: NDArray[np.float64]
    missed: NDArray[np.bool_]
    height: NDArray[np.float64]
    lateral: NDArray[np.float64]
    rise: NDArray[np.float64]
    drift: NDArray[np.float64]

    @staticmethod
    @lru_cache(maxsize=2)
    def of(camera: Camera, domain: Domain) -> PlaneRays:
        lateral, depth, height = view_frame(camera)
        origin, direction = ray_through_pixels(camera)
        start = origin - np.array(domain.centre)
        half = np.array(domain.max) - np.array(domain.centre)
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = np.stack([(-half - start) / direction, (half - start) / direction])
            near, far = np.nanmax(sides.min(0), -1), np.nanmin(sides.max(0), -1)
        near = np.maximum(near, 0)
        along, here = direction @ depth, start @ depth
        missed = (far <= near) | (along < MIN_ALONG)
        along = np.maximum(along, MIN_ALONG)
        near, far = (np.where(missed, 0, here + end * along) for end in (near, far))
        rise, drift = ((direction @ axis) / along for axis in (height, lateral))
        return PlaneRays(near, far, missed, start @ height - here * rise, start @ lateral - here * drift, rise, drift)

    def at(self, depth: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Heights and laterals of the rays at some depths (rows, columns), or where they are nearest in the domain."""
        inside = np.clip(depth, self.near, self.far)
        return self.height + inside * self.rise, self.lateral + inside * self.drift


def reach_along(domain: Domain, direction: NDArray[np.float64]) -> float:
    """Half the domain's extent (m) along a direction."""
    return float(np.abs(direction) @ (np.array(domain.max) - np.array(domain.centre)))


@dataclass(frozen=True, eq=False)
class PlanePicture:
    """A picture on the upright plane through the domain's center.

    Its `values` (n, m) are at `heights` (n,) above the center and `laterals` (m,) from it, in meters.
    """

    heights: NDArray[np.float64]
    laterals: NDArray[np.float64]
    values: NDArray[np.float64]

    @property
    def total(self) -> NDArray[np.float64]:
        """The amount (n,) in each row, in columns."""
        return np.asarray(self.values.sum(1))

    @property
    def mean(self) -> NDArray[np.float64]:
        """Mean lateral position (n,) in each row (m): 0 where there is nothing."""
        return np.asarray(self.values @ self.laterals / np.maximum(self.total, TINY))

    @property
    def spread(self) -> NDArray[np.float64]:
        """Lateral standard deviation (n,) in each row (m): 0 where there is nothing."""
        squares = (self.laterals - self.mean[:, None]) ** 2
        return np.asarray(np.sqrt((self.values * squares).sum(1) / np.maximum(self.total, TINY)))

    def read(self, heights: NDArray[np.float64], laterals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at some heights and lateral places, linear between the pixels; the nearest beyond the ends."""
        return read_linearly(self.values, self.heights, self.laterals, heights, laterals)


def read_linearly(
    values: NDArray[np.float64],
    rows: NDArray[np.float64],
    columns: NDArray[np.float64],
    heights: NDArray[np.float64],
    laterals: NDArray[np.float64] | float,
) -> NDArray[np.float64]:
    """Values (n, m) at heights (n,) and laterals (m,), read linearly at others; the nearest beyond the ends."""
    at = np.interp(heights, rows, np.arange(len(rows))), np.interp(laterals, columns, np.arange(len(columns)))
    return np.asarray(ndimage.map_coordinates(values, np.broadcast_arrays(*at), order=1, mode="nearest"))


def on_upright_plane(amount: NDArray[np.float32], camera: Camera, domain: Domain, per_voxel: int) -> PlanePicture:
    """Put a picture (rows, columns) on the upright plane, ``per_voxel`` rows to a voxel and one column."""
    lateral, depth, height = view_frame(camera)
    center = np.array(domain.centre)
    h = domain.voxel_size
    sideways = reach_along(domain, lateral)
    across = np.arange(-sideways + h / 2, sideways, h)
    # what stands before the plane shows beyond the domain's ends there
    ends = reach_along(domain, height) + reach_along(domain, depth) / 2
    up = np.arange(-ends + h / (2 * per_voxel), ends, h / per_voxel)
    points = center + across[None, :, None] * lateral + up[:, None, None] * height
    return PlanePicture(up, across, seen_at(points, amount, camera))


def seen_at(points: NDArray[np.float64], picture: NDArray[np.float32], camera: Camera) -> NDArray[np.float64]:
    """What a picture (rows, columns) shows at points (..., 3), in meters; zero outside and behind the camera."""
    pixels, distance = project_points(camera, points)
    at = pixels[..., 1] - 0.5, pixels[..., 0] - 0.5
    values = ndimage.map_coordinates(picture.astype(np.float64), at, order=1, mode="constant")
    return np.where(distance > 0, values, 0.0)
