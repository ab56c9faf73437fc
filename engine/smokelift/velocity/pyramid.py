"""Densities and velocities on grids that are each half as fine as the one before, and back on the finest near smoke.

A velocity of a coarse grid is refined where smoke is and where it can arrive: most of a box holds none.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Mask
from smokelift.scene.domain import box_around
from smokelift.transport import (
    Array,
    Faces,
    StaggeredGrid,
    Velocity,
    VoxelBox,
    advect,
    face_shapes,
    faces_in,
    halved,
    part_of,
    without_divergence,
)

COARSEST_SIDE, MIN_SIDE = 30, 8
"""Voxels along the longest side of the coarsest grid at most, if no side gets shorter than the second. Motion of
several voxels is found there; and one view leaves the depth undetermined, so that finer velocities of a reconstruction
follow its errors (docs/experiments/velocity-solver.md)."""

SMOOTHING = 1 / 4
"""Weight of each neighbor along an axis, which leaves nothing of what changes its sign from voxel to voxel.

What a reconstruction's coarse grid shows of that is most often wrong (docs/experiments/velocity-solver.md)."""

REACH = 1
"""Coarse voxels around a box that its fine velocity depends on; see `prolong`."""

MIN_SLAB_VOXELS = 4_000_000
"""Voxels of a box around smoke above which it is cut into slabs, each as narrow as the smoke is there."""

SLAB = 64
"""Voxels across a slab: many more than smoke moves in a step."""


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


def refine(coarse: Velocity, shape: tuple[int, int, int], box: VoxelBox | None = None) -> Velocity:
    """A velocity refined to the grid (shape) that its own was halved from; itself if it is on that already.

    It has no divergence there. In a box of its voxels it is the same, as the velocity of a box of its own.
    """
    if coarse.shape == shape:
        return coarse if box is None else part_of(coarse, box)
    half, box = halved(shape), box or (slice(0, shape[0]), slice(0, shape[1]), slice(0, shape[2]))
    x, y, z = (
        slice(max(side.start // 2 - REACH, 0), min((side.stop + 1) // 2 + REACH, count))
        for side, count in zip(box, half, strict=True)
    )
    part = refine(coarse, half, (x, y, z))
    counts = tuple(min(2 * side.stop, end) - 2 * side.start for side, end in zip((x, y, z), shape, strict=True))
    fine = Velocity(prolong(part, counts), part.voxel_size / 2, part.closed, figures=part.figures)
    i, j, k = (
        slice(inner.start - 2 * outer.start, inner.stop - 2 * outer.start)
        for inner, outer in zip(box, (x, y, z), strict=True)
    )
    return part_of(fine, (i, j, k))


def advect_near(density: Array, velocity: Velocity, dt: float, voxel_size: float, *, conserve: bool = False) -> Array:
    """Carry a density (nx, ny, nz), not negative, along by a velocity of its grid or of one that was halved from it.

    It gives what `advect` makes of it with `refine`, but for rounding. ``dt`` is in seconds, ``voxel_size`` of the
    density in meters; ``conserve`` is that of `advect`.
    """
    x, y, z = density.shape
    result = np.zeros(density.shape, np.float32)
    for box, source in _boxes(density > 0, _reach(velocity, dt / voxel_size), whole=conserve):
        along = refine(velocity, (x, y, z), source)
        moved = advect(density[source], along, dt, conserve=conserve)
        inner = moved[tuple(slice(a.start - b.start, a.stop - b.start) for a, b in zip(box, source, strict=True))]
        # memory is given where something is written: where the smoke is, not all over its box
        np.copyto(result[box], inner, where=inner > 0)
    return result


def refine_near_smoke(velocity: Velocity, smoke: Mask, dt: float, voxel_size: float) -> Velocity:
    """Refine a velocity to the grid of the smoke where that can arrive; it is zero elsewhere.

    ``smoke`` (nx, ny, nz) marks voxels of ``voxel_size`` meters; ``dt`` is in seconds. The velocity's grid was halved
    from that of the smoke; a velocity on the smoke's grid is returned as it is.
    """
    x, y, z = smoke.shape
    if velocity.shape == smoke.shape:
        return velocity
    i, j, k = (np.zeros(shape, np.float32) for shape in face_shapes(smoke.shape))
    for box, _ in _boxes(smoke, _reach(velocity, dt / voxel_size)):
        part = refine(velocity, (x, y, z), box)
        for component, found in zip(faces_in((i, j, k), box), part.faces, strict=True):
            component[...] = found
    return Velocity((i, j, k), voxel_size, velocity.closed, figures=velocity.figures)


def _reach(velocity: Velocity, voxels_at_one: float) -> int:
    """Voxels that smoke can arrive in or come from, if it moves ``voxels_at_one`` at 1 m/s."""
    fastest = max(float(np.abs(component).max()) for component in velocity.faces) * voxels_at_one
    # what arrives was a step away, and the correction of advection looks a step further
    return 2 * (math.ceil(fastest) + 1)


def _boxes(smoke: Mask, reach: int, *, whole: bool = False) -> list[tuple[VoxelBox, VoxelBox]]:
    """Boxes of the voxels where smoke can arrive, each with the one that it comes from.

    There is one box, or a large one is cut into slabs along its longest side.
    """
    box = box_around(smoke, reach)
    sides = [side.stop - side.start for side in box]
    if math.prod(sides) == 0:
        return []
    if whole or math.prod(sides) <= MIN_SLAB_VOXELS:
        return [(box, box)]
    axis, boxes = int(np.argmax(sides)), []
    lead = (slice(None),) * axis
    for start in range(box[axis].start, box[axis].stop, SLAB):
        slab = slice(start, min(start + SLAB, box[axis].stop))
        beside = slice(max(slab.start - reach, 0), min(slab.stop + reach, smoke.shape[axis]))
        spans = list(box_around(smoke[(*lead, beside)], reach))
        if spans[axis].stop:
            x, y, z = (slab if n == axis else span for n, span in enumerate(spans))
            i, j, k = (beside if n == axis else span for n, span in enumerate(spans))
            boxes.append(((x, y, z), (i, j, k)))
    return boxes
