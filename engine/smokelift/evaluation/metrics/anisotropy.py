"""How much a density changes along the camera's rays, relative to across them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from smokelift.checks import shown
from smokelift.evaluation.metrics.checks import finite


def depth_anisotropy(density: npt.ArrayLike, axis: int = 1) -> float:
    """Return how much a density changes from voxel to voxel along one axis, relative to across it.

    Parameters
    ----------
    density : (nx, ny, nz)
    axis
        The one that the camera looks along.

    Returns
    -------
    RMS of the differences between neighbours along the axis over that along the other two: about 1 for smoke, near 0
    for a picture drawn out into the depth, infinity if nothing changes across the axis.

    Raises
    ------
    ValueError
        If a value is not finite, the density has not three axes, or there is no such axis.
    """
    values = finite(density)
    if values.ndim != 3:
        raise ValueError(f"depth anisotropy needs a density (nx, ny, nz), not one of shape {values.shape}")
    if axis not in range(-3, 3):
        raise ValueError(f"axis must be 0, 1 or 2, not {shown(axis)}")
    changes = [float(np.sum(np.diff(values, axis=k) ** 2)) for k in range(3)]
    along = math.sqrt(changes.pop(axis))
    across = math.sqrt(sum(changes) / 2)
    if across == 0.0:
        return 0.0 if along == 0.0 else math.inf
    return along / across
