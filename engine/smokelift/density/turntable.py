"""What is seen of the smoke when it is turned about an axis of the grid, at one pixel per voxel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import smokelift._core as _core
from smokelift.checks import Array, Doubles
from smokelift.density.upright_plane import seen_at, view_frame
from smokelift.scene import Camera, Domain, as_matrix

Volume = NDArray[np.float32]
DepthMap = NDArray[np.float32]
"""Optical depth, or the like, (columns, voxels along the axis): one pixel per voxel, upwards."""


@dataclass(frozen=True, eq=False)
class Turntable:
    """A domain on a turntable before a camera, with an upright plane through its center.

    `lateral`, `depth` and `height` (3,) are the directions (unit, world) of the view that faces the plane. The domain
    turns about `height`, an axis of the grid through its center.
    """

    lateral: Doubles
    depth: Doubles
    height: Doubles
    domain: Domain

    @staticmethod
    def facing(camera: Camera, domain: Domain, axis: int | None = None) -> Turntable:
        """Put a domain in front of a camera, on the given axis of the grid or the one nearest to the view's height."""
        _, depth, up = view_frame(camera)
        axis = int(np.argmax(np.abs(up))) if axis is None else axis
        height = np.zeros(3)
        # of a lying axis the end to the right is the top, so that the plane is the picture on its side
        along = up[axis] if abs(up[axis]) > 1e-6 else np.cross(depth, up)[axis]
        height[axis] = 1.0 if along >= 0 else -1.0
        depth = depth - (depth @ height) * height
        depth /= np.linalg.norm(depth)
        return Turntable(np.cross(depth, height), depth, height, domain)

    @cached_property
    def axis(self) -> int:
        """The grid's axis that the domain turns about."""
        return int(np.argmax(np.abs(self.height)))

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Columns of the plane, which holds the domain however it is turned, and voxels along the axis."""
        corners = (self.domain.corners() - np.array(self.domain.centre)) / self.domain.voxel_size
        columns = np.max(np.hypot(corners @ self.lateral, corners @ self.depth))
        return int(np.ceil(2 * columns - 1e-6)), self.domain.resolution[self.axis]

    def camera(self, degrees: float) -> Camera:
        """The orthographic camera that sees the domain turned; it stands to the right at 90 degrees."""
        right = self.right(degrees)
        back = np.cross(right, self.height)
        distance = np.linalg.norm(np.array(self.domain.max) - self.domain.min)
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([right, self.height, back], -1)
        matrix[:3, 3] = np.array(self.domain.centre) + distance * back
        columns, rows = self.shape
        scale = 1 / self.domain.voxel_size
        return Camera("orthographic", as_matrix(matrix), (columns, rows), scale, scale, columns / 2, rows / 2)

    def degrees(self, camera: Camera) -> float:
        """How far the domain is turned for a camera: the inverse of `camera`."""
        back = np.array(camera.matrix)[:3, 2]
        return float(np.degrees(np.arctan2(back @ self.lateral, -(back @ self.depth))))

    def on_plane(self, picture: Array, camera: Camera) -> DepthMap:
        """Put a camera's picture (rows, columns) on the plane; zero where it shows nothing."""
        columns, voxels = self.shape
        h = self.domain.voxel_size
        side = (np.arange(columns) + 0.5 - columns / 2) * h
        up = (np.arange(voxels) + 0.5 - voxels / 2) * h
        points = np.array(self.domain.centre) + side[:, None, None] * self.lateral + up[:, None] * self.height
        return seen_at(points, picture, camera).astype(np.float32)

    def upright(self, volume: Volume) -> Volume:
        """A copy of a volume (nx, ny, nz) with its axis last, upwards."""
        turned = np.moveaxis(volume, self.axis, -1)
        return np.array(turned if self.height[self.axis] > 0 else turned[..., ::-1], order="C")

    def lying(self, upright: Volume) -> Volume:
        """The inverse of `upright`."""
        turned = upright if self.height[self.axis] > 0 else upright[..., ::-1]
        return np.ascontiguousarray(np.moveaxis(turned, -1, self.axis))

    def right(self, degrees: float) -> Doubles:
        """What lies to the right (3,) in a turned view."""
        turn = np.radians(degrees)
        return np.asarray(np.cos(turn) * self.lateral + np.sin(turn) * self.depth)


class UprightSmoke(NamedTuple):
    """Smoke, or a part of it, upright on a turntable.

    `corner` is its first column of voxels in the domain. `spans` are the first voxel and the end of each of its columns
    that hold any smoke, (n, m, 2): the work is there alone.
    """

    table: Turntable
    values: Volume
    corner: tuple[int, int]
    spans: NDArray[np.int32]

    @staticmethod
    def of(table: Turntable, values: Volume, corner: tuple[int, int] = (0, 0)) -> UprightSmoke:
        return UprightSmoke(table, values, corner, _core.filled_spans(values))

    def picture(self, degrees: float) -> DepthMap:
        """Sums (columns, voxels along the axis) along the rays of a turned view."""
        return _core.project_turned(self.values, self.spans, *self._turned(degrees), self.table.shape[0])

    def scale(self, logarithm: DepthMap, degrees: float) -> None:
        """Multiply the smoke along the rays of a turned view by exponentials of a picture."""
        _core.scale_turned(self.values, self.spans, *self._turned(degrees), logarithm)

    def _turned(self, degrees: float) -> tuple[float, tuple[float, float]]:
        """Screen column of the first column of voxels, and the steps to the next ones along both other axes."""
        table = self.table
        right = table.right(degrees)
        a, b = (axis for axis in range(3) if axis != table.axis)
        steps = float(right[a]), float(right[b])
        middles = [(self.corner[n] - (table.domain.resolution[axis] - 1) / 2) for n, axis in enumerate((a, b))]
        first = middles[0] * steps[0] + middles[1] * steps[1] + (table.shape[0] - 1) / 2
        return first, steps
