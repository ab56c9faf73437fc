"""What is seen of the smoke when it is turned about the view's height, at a pixel a voxel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.density.row_shape import Array
from smokelift.density.screen import seen_at, view_frame
from smokelift.scene import Camera, Domain, as_matrix


@dataclass(frozen=True, eq=False)
class Turntable:
    """A domain on a turntable before a camera, with a screen through its centre.

    Attributes
    ----------
    lateral, depth, height : (3,)
        Directions (unit, world) of the view that faces the screen; see `view_frame`.
    domain
        Its centre is on the axis.
    """

    lateral: Array
    depth: Array
    height: Array
    domain: Domain

    @staticmethod
    def before(camera: Camera, domain: Domain) -> Turntable:
        """Put a domain before a camera."""
        return Turntable(*view_frame(camera), domain)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the screen, which holds the domain however it is turned."""
        corners = (self.domain.corners() - np.array(self.domain.centre)) / self.domain.voxel_size
        rows = np.max(corners @ self.height)
        columns = np.max(np.hypot(corners @ self.lateral, corners @ self.depth))
        return int(np.ceil(2 * rows - 1e-6)), int(np.ceil(2 * columns - 1e-6))

    def camera(self, degrees: float) -> Camera:
        """Return the orthographic camera that sees the domain turned; it stands to the right at 90 degrees."""
        turn = np.radians(degrees)
        right = np.cos(turn) * self.lateral + np.sin(turn) * self.depth
        back = np.cross(right, self.height)
        distance = np.linalg.norm(np.array(self.domain.max) - self.domain.min)
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([right, self.height, back], -1)
        matrix[:3, 3] = np.array(self.domain.centre) + distance * back
        rows, columns = self.shape
        scale = 1 / self.domain.voxel_size
        return Camera("orthographic", as_matrix(matrix), (columns, rows), scale, scale, columns / 2, rows / 2)

    def degrees(self, camera: Camera) -> float:
        """Return how far the domain is turned for a camera: the inverse of `camera`."""
        back = np.array(camera.matrix)[:3, 2]
        return float(np.degrees(np.arctan2(back @ self.lateral, -(back @ self.depth))))

    def screen(self, picture: NDArray[np.float32], camera: Camera) -> Array:
        """Put a camera's picture (rows, columns) on the screen (rows, columns); zero where it shows nothing."""
        rows, columns = self.shape
        h = self.domain.voxel_size
        side = (np.arange(columns) + 0.5 - columns / 2) * h
        up = (rows / 2 - np.arange(rows) - 0.5) * h
        points = np.array(self.domain.centre) + side[None, :, None] * self.lateral + up[:, None, None] * self.height
        return seen_at(points, picture, camera)
