"""Cameras made from other cameras."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smokelift.scene.description import Camera, Domain, Matrix


def as_matrix(values: NDArray[np.float64]) -> Matrix:
    """A 4x4 array as the nested tuples that a frozen camera holds."""
    rows = [tuple(float(v) for v in row) for row in values]
    return tuple((r[0], r[1], r[2], r[3]) for r in rows)


def orbit(camera: Camera, domain: Domain, yaw_degrees: float, pitch_degrees: float = 0.0) -> Camera:
    """The camera carried around the domain's centre, still looking at it from the same distance.

    Parameters
    ----------
    yaw_degrees
        Turn about the world's Z, counter-clockwise seen from above: 90 looks from the right side.
    pitch_degrees
        Then raise the camera by so much; negative lowers it.
    """
    centre = np.array(domain.centre)
    matrix = np.array(camera.matrix, np.float64)
    right = matrix[:3, 0]
    turn = _rotation(np.array([0.0, 0.0, 1.0]), yaw_degrees) @ _rotation(right, -pitch_degrees)
    moved = matrix.copy()
    moved[:3, :3] = turn @ matrix[:3, :3]
    moved[:3, 3] = centre + turn @ (matrix[:3, 3] - centre)
    return replace(camera, matrix=as_matrix(moved))


def _rotation(axis: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    """Rotation matrix about a unit axis (Rodrigues)."""
    angle = np.radians(degrees)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
