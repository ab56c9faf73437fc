"""The upright plane through the domain's center: one picture's rows as heights in the world, and the smoke's axis.

Depth profiles are centered on the axis, which stands before or behind the plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from scipy import ndimage

from smokelift.checks import Array, Doubles, Mask
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import project_points, ray_through_pixels

TINY_DOUBLE = np.finfo(np.float64).tiny
"""Smallest normal number, for divisions."""

MIN_ALONG = 1e-3
"""Smallest cosine between a ray and the depth: a ray across it meets no depth."""


def view_frame(camera: Camera) -> tuple[Doubles, Doubles, Doubles]:
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

    near: Doubles
    far: Doubles
    missed: Mask
    height: Doubles
    lateral: Doubles
    rise: Doubles
    drift: Doubles

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

    def at(self, depth: Doubles) -> tuple[Doubles, Doubles]:
        """Heights and laterals of the rays at some depths (rows, columns), or where they are nearest in the domain."""
        inside = np.clip(depth, self.near, self.far)
        return self.height + inside * self.rise, self.lateral + inside * self.drift


def reach_along(domain: Domain, direction: Doubles) -> float:
    """Half the domain's extent (m) along a direction."""
    return float(np.abs(direction) @ (np.array(domain.max) - np.array(domain.centre)))


@dataclass(frozen=True, eq=False)
class PlanePicture:
    """A picture on the upright plane through the domain's center.

    Its `values` (n, m) are at `heights` (n,) above the center and `laterals` (m,) from it, in meters.
    """

    heights: Doubles
    laterals: Doubles
    values: Doubles

    @property
    def total(self) -> Doubles:
        """The amount (n,) in each row, in columns."""
        return np.asarray(self.values.sum(1))

    @property
    def mean(self) -> Doubles:
        """Mean lateral position (n,) in each row (m): 0 where there is nothing."""
        return np.asarray(self.values @ self.laterals / np.maximum(self.total, TINY_DOUBLE))

    @property
    def spread(self) -> Doubles:
        """Lateral standard deviation (n,) in each row (m): 0 where there is nothing."""
        squares = (self.laterals - self.mean[:, None]) ** 2
        return np.asarray(np.sqrt((self.values * squares).sum(1) / np.maximum(self.total, TINY_DOUBLE)))

    def read(self, heights: Doubles, laterals: Doubles) -> Doubles:
        """Values at some heights and lateral places, linear between the pixels; the nearest beyond the ends."""
        return read_linearly(self.values, self.heights, self.laterals, heights, laterals)


def read_linearly(
    values: Doubles, rows: Doubles, columns: Doubles, heights: Doubles, laterals: Doubles | float
) -> Doubles:
    """Values (n, m) at heights (n,) and laterals (m,), read linearly at others; the nearest beyond the ends."""
    at = np.interp(heights, rows, np.arange(len(rows))), np.interp(laterals, columns, np.arange(len(columns)))
    return np.asarray(ndimage.map_coordinates(values, np.broadcast_arrays(*at), order=1, mode="nearest"))


def on_upright_plane(optical_depth: Array, camera: Camera, domain: Domain, per_voxel: int) -> PlanePicture:
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
    return PlanePicture(up, across, seen_at(points, optical_depth, camera))


def seen_at(points: Doubles, picture: Array, camera: Camera) -> Doubles:
    """What a picture (rows, columns) shows at points (..., 3), in meters; zero outside and behind the camera."""
    pixels, distance = project_points(camera, points)
    at = pixels[..., 1] - 0.5, pixels[..., 0] - 0.5
    values = ndimage.map_coordinates(picture.astype(np.float64), at, order=1, mode="constant")
    return np.where(distance > 0, values, 0.0)


@dataclass(frozen=True, eq=False)
class SmokeAxis:
    """How far behind the domain's center the middle of the smoke is, on the upright plane through the center."""

    heights: Doubles
    """(n,): meters above the center, ascending, along `view_frame`'s height."""
    laterals: Doubles
    """(m,): meters from the center, ascending, along its lateral direction; one where there is one column."""
    depths: Doubles
    """(n, m): meters away from the camera, along its depth direction."""
    spreads: Doubles
    """(n, m): standard deviation (m) of the depth over the columns that stand behind one another."""
    widths: Doubles
    """(n, m): lateral standard deviation (m) of the column that shows there, if there are several; else zero."""

    @staticmethod
    def by_height(heights: Doubles, depths: Doubles) -> SmokeAxis:
        """One column, whose depth (n,) depends on the height (n,) alone."""
        nothing = np.zeros((len(depths), 1))
        return SmokeAxis(heights, np.zeros(1), np.reshape(depths, (-1, 1)), nothing, nothing)

    @staticmethod
    def upright(depth: float = 0.0) -> SmokeAxis:
        """One column of the same depth (m) at all heights."""
        return SmokeAxis.by_height(np.zeros(1), np.full(1, float(depth)))

    @property
    def several(self) -> bool:
        """Whether several columns are known."""
        return len(self.laterals) > 1

    def at(self, heights: Doubles, laterals: Doubles | float = 0.0) -> Doubles:
        """Depths at some heights and lateral places."""
        return self.read(self.depths, heights, laterals)

    def read(self, values: Doubles, heights: Doubles, laterals: Doubles | float) -> Doubles:
        """Depths, spreads or widths (n, m) at some heights and lateral places."""
        return read_linearly(values, self.heights, self.laterals, heights, laterals)


def depth_at(distance: float, camera: Camera, domain: Domain) -> float:
    """Depth (m behind the domain's center) of what stands at a level distance (m) ahead of a camera.

    It raises ValueError outside the domain.
    """
    along = view_frame(camera)[1]
    middle = float((np.array(domain.centre) - np.array(camera.position)) @ along)
    reach = reach_along(domain, along)
    if abs(distance - middle) >= reach:
        raise ValueError(
            f"The distance {distance:g} m is outside the box, which reaches from {middle - reach:.3g} to "
            f"{middle + reach:.3g} m ahead of the camera; give a number between."
        )
    return distance - middle


Cue = Literal["box", "floor contact", "inlets", "distance"]
"""What shows where the smoke stands; the box alone leaves it undetermined."""


@dataclass(frozen=True, eq=False)
class AxisEstimate:
    """An axis, the cue that shows it, and how well it is known.

    `axis` is the likeliest, `depth` the mean depth (m behind the domain's center) of smoke that stands on it, and
    `deviation` the standard deviation (m) of that depth's error.
    """

    axis: SmokeAxis
    cue: Cue
    depth: float
    deviation: float
