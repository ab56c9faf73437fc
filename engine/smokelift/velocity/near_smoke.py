"""A velocity of a coarser grid on the density's, where smoke is and where it can arrive: most of a box holds none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from smokelift.scene.domain import box_around
from smokelift.transport import Array, Velocity, VoxelBox, advect, faces_in
from smokelift.velocity.estimator import Mask, refined_in


def carry(density: Array, velocity: Velocity, dt: float, voxel_size: float, *, conserve: bool = False) -> Array:
    """Carry a density along by a velocity of its grid or of a coarser one.

    Parameters
    ----------
    density : (nx, ny, nz)
        Not negative.
    velocity
        On the density's grid, or on one that was halved from it.
    dt
        Time step in seconds.
    voxel_size
        Of the density, in metres.
    conserve
        As of `advect`.

    Returns
    -------
    (nx, ny, nz) float32
        What `advect` makes of it with `refined_to`, but for rounding.
    """
    result: Array = np.zeros(density.shape, np.float32)
    box = _reached(density > 0, velocity, dt / voxel_size)
    if result[box].size:
        x, y, z = density.shape
        result[box] = advect(density[box], refined_in(velocity, (x, y, z), box), dt, conserve=conserve)
    return result


def near_smoke(velocity: Velocity, smoke: Mask, dt: float, voxel_size: float) -> Velocity:
    """Refine a velocity where smoke can arrive.

    Parameters
    ----------
    velocity
        On the grid of the smoke, or on one that was halved from it.
    smoke : (nx, ny, nz) bool
        Voxels with smoke.
    dt
        Time step in seconds.
    voxel_size
        Of the smoke's grid, in metres.

    Returns
    -------
    Velocity
        On the smoke's grid, zero elsewhere; itself if it is on that already.
    """
    x, y, z = smoke.shape
    if velocity.shape == smoke.shape:
        return velocity
    box = _reached(smoke, velocity, dt / voxel_size)
    near = Velocity.zero(smoke.shape, voxel_size, velocity.closed)
    if not smoke[box].size:
        return near
    part = refined_in(velocity, (x, y, z), box)
    for component, found in zip(faces_in(near.faces, box), part.faces, strict=True):
        component[...] = found
    confidence, source = (_placed(values, box, smoke.shape) for values in (part.confidence, part.source))
    return replace(near, figures=part.figures, confidence=confidence, source=source, residual=velocity.residual)


def _placed(values: Array | None, box: VoxelBox, shape: tuple[int, ...]) -> Array | None:
    """Values of a box in all of the grid, zero elsewhere."""
    if values is None:
        return None
    result: Array = np.zeros(shape, np.float32)
    result[box] = values
    return result


def _reached(smoke: Mask, velocity: Velocity, voxels_at_one: float) -> VoxelBox:
    """The box of the voxels where smoke can arrive; at 1 m/s it moves by so many voxels."""
    fastest = max(float(np.abs(component).max()) for component in velocity.faces) * voxels_at_one
    # what arrives was a step away, and the correction of advection looks a step further
    return box_around(smoke, 2 * (math.ceil(fastest) + 1))
