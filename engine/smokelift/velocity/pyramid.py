"""Densities and velocities on grids that are each half as fine as the one before."""

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.transport import Array, Faces, StaggeredGrid, Velocity, faces_in, halved, without_divergence

COARSEST_SIDE, MIN_SIDE = 30, 8
"""Voxels along the longest side of the coarsest grid at most, if no side gets shorter than the second. Motion of
several voxels is found there; and one view leaves the depth undetermined, so that finer velocities of a reconstruction
follow its errors (docs/experiments/velocity-solver.md)."""

SMOOTHING = 1 / 4
"""Weight of each neighbor along an axis, which leaves nothing of what changes its sign from voxel to voxel.

What a reconstruction's coarse grid shows of that is most often wrong (docs/experiments/velocity-solver.md)."""


def default_coarsening(shape: tuple[int, int, int]) -> int:
    """How many times a grid is halved until its longest side has `COARSEST_SIDE` voxels at most."""
    count = 0
    while max(shape) > COARSEST_SIDE and min(shape) >= 2 * MIN_SIDE:
        count, shape = count + 1, halved(shape)
    return count


def prolong(u: StaggeredGrid, shape: Sequence[int]) -> Faces:
    """The faces of a velocity on the next finer grid, in the same unit, without divergence.

    The formulas for a coarse voxel (Toth and Roe 2002) read only its neighbors. Along an odd number of voxels the last
    coarse one is cut in half.
    """
    x, y, z = _core.prolong(u.faces)
    faces = faces_in((x, y, z), tuple(slice(0, count) for count in shape))
    cut = [wall and count % 2 == 1 for wall, count in zip(u.walls[1::2], shape, strict=True)]
    if not any(cut):
        return faces
    # no formula of single voxels stops the flow at a wall that cuts them
    return without_divergence(StaggeredGrid(faces, 1.0, u.closed))[0].faces


def smooth_velocity(velocity: Velocity) -> Velocity:
    """A velocity with every component smoothed alike along all axes, which keeps a divergence of zero."""
    faces = []
    for along, component in enumerate(velocity.faces):
        for axis in range(3):
            mean = ndimage.correlate1d(component, (SMOOTHING, 1 - 2 * SMOOTHING, SMOOTHING), axis, mode="nearest")
            if axis == along:  # beyond the box it goes on linearly, and so does its divergence
                ends = np.moveaxis(mean, axis, 0)
                ends[[0, -1]] = np.moveaxis(component, axis, 0)[[0, -1]]
            component = mean
        faces.append(component)
    return velocity.with_faces(faces)


def coarsen_density(a: Array) -> Array:
    """Means of two along every axis; an odd last one counts twice."""
    odd = [(0, count % 2) for count in a.shape]
    return _core.means_of_two(np.pad(a, odd, mode="edge") if np.any(odd) else np.ascontiguousarray(a))


def coarsen_velocity(velocity: Velocity) -> Velocity:
    """A velocity on a grid half as fine: what goes in and out of eight voxels together."""
    faces = []
    for along, component in enumerate(velocity.faces):
        # an odd last voxel, or its far side, stands for one beyond it
        missing = [(0, (count - (axis == along)) % 2) for axis, count in enumerate(component.shape)]
        component = np.pad(component, missing, mode="edge")
        for axis in range(3):
            even, odd = (component.take(range(start, component.shape[axis], 2), axis) for start in (0, 1))
            component = even if axis == along else np.float32(0.5) * (even + odd)
        faces.append(component)
    x, y, z = faces
    return Velocity((x, y, z), 2 * velocity.voxel_size, velocity.closed)
