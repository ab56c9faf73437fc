"""What one camera alone leaves open in a velocity: how it changes along the line of sight.

The detail of a density from one view is in the right place of the picture. Its depth and its profile along the ray are
assumed. The expected velocity is the mean over all depths that the smoke may have, which hardly changes along the ray.
So the velocity is averaged along the line of sight (docs/experiments/velocity-one-view.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.transport import Velocity, without_divergence

Direction = tuple[float, float, float]

SPREAD = 1 / 8
"""Standard deviation of the average, in shortest sides of the box, which is cut out around the smoke."""

REACH = 2.5
"""Reach of the average, in standard deviations."""


def averaged_along(velocity: Velocity, line: Direction) -> Velocity:
    """A velocity averaged along a line of sight, without divergence; what is known of it stays as it is.

    The line has any length and either direction.
    """
    kernel = _line(np.array(line) / np.linalg.norm(line), SPREAD * min(velocity.shape))
    # one kernel for all components keeps the divergence zero, but not at the sides of the box
    means = (ndimage.correlate(component, kernel, mode="nearest") for component in velocity.faces)
    return velocity.with_faces(without_divergence(velocity.with_faces(means))[0].faces)


def _line(direction: NDArray[np.float64], deviation: float) -> NDArray[np.float32]:
    """A Gaussian of so many voxels on a line through the middle of a box: eight voxels share every point."""
    ends = int(np.ceil(REACH * deviation))
    along = np.arange(-ends, ends + 1)
    points, amounts = along[:, None] * direction, np.exp(-0.5 * np.square(along / deviation))
    half = np.ceil(np.abs(ends * direction)).astype(int) + 1
    kernel = np.zeros(2 * half + 1)
    low = np.floor(points).astype(int)
    for corner in np.ndindex(2, 2, 2):
        shares = np.prod(np.where(corner, points - low, 1 - (points - low)), axis=1)
        np.add.at(kernel, tuple((low + corner + half).T), amounts * shares)
    return np.asarray(kernel / kernel.sum(), np.float32)
