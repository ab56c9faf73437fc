"""Volumes on other grids over the same box."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smokelift.footage.images import area_average
from smokelift.scene import CompleteScene
from smokelift.transport import Array


def on_grid(scene: CompleteScene, shape: tuple[int, int, int]) -> CompleteScene:
    """Return a scene whose box has so many voxels."""
    return replace(scene, domain=replace(scene.domain, resolution=shape))


def resampled(values: Array, shape: tuple[int, int, int]) -> Array:
    """Return a volume (nx, ny, nz, ...) on another grid over the same box.

    Along an axis where that is coarser its values are means, otherwise they are interpolated.
    """
    if values.shape[:3] == tuple(shape):
        return values
    x, y, z = shape
    rest = values.shape[3:]
    flat = area_average(values.reshape(*values.shape[:2], -1), y, x)  # two axes, then the third
    upright = np.moveaxis(flat.reshape(x, y, values.shape[2], *rest), 2, 0)
    layers = area_average(upright.reshape(values.shape[2], -1, 1), x * y * int(np.prod(rest, dtype=int)), z)
    return np.ascontiguousarray(np.moveaxis(layers.reshape(z, x, y, *rest), 0, 2))
