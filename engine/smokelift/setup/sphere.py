"""Directions that light is tried from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def spread(count: int) -> NDArray[np.float64]:
    """Return unit vectors (count, 3), spread evenly over the sphere along a spiral that turns by the golden angle.

    Examples
    --------
    >>> bool(np.abs(spread(48).mean(0)).max() < 0.01)
    True
    """
    step = np.arange(count)
    z = 1 - 2 * (step + 0.5) / count
    angle, radius = np.pi * (3 - 5**0.5) * step, np.sqrt(1 - z * z)
    return np.stack((radius * np.cos(angle), radius * np.sin(angle), z), -1)
