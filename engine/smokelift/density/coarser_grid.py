"""Voxels of a grid and of one half as fine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MIN_COARSENED_VOXELS = 1_000_000
"""Voxels that may hold smoke above which a grid has a coarser one (docs/experiments/clip-pixels.md)."""


def any_of_two(voxels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether any of two voxels along every axis is marked."""
    for axis in range(3):
        lead = (slice(None),) * axis
        second = voxels[(*lead, slice(1, None, 2))]
        voxels = voxels[(*lead, slice(0, None, 2))].copy()
        voxels[(*lead, slice(0, second.shape[axis]))] |= second
    return voxels


def spread_to_two(voxels: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Mark the voxels of a grid (shape) that the marked ones of a grid half as fine are made of."""
    x, y, z = (slice(0, count) for count in shape)
    return voxels.repeat(2, 0).repeat(2, 1).repeat(2, 2)[x, y, z]


def every_second(voxels: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Mark the first voxel of a grid (shape) in each that is marked on a grid half as fine."""
    result = np.zeros(shape, np.bool_)
    result[::2, ::2, ::2] = voxels
    return result


def with_neighbours(voxels: NDArray[np.bool_], *, corners: bool = False) -> NDArray[np.bool_]:
    """Mark the six voxels beside each marked one too, with corners all 26: a fast `ndimage.binary_dilation`."""
    result = voxels.copy()
    for axis in range(3):
        lead = (slice(None),) * axis
        low, high = (*lead, slice(None, -1)), (*lead, slice(1, None))
        before = result.copy() if corners else voxels
        result[high] |= before[low]
        result[low] |= before[high]
    return result
