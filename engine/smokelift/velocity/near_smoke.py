"""A velocity of a coarser grid on the density's, where smoke is and where it can arrive: most of a box holds none."""

import math

import numpy as np

from smokelift.checks import Mask
from smokelift.scene.domain import box_around
from smokelift.transport import Array, Velocity, VoxelBox, advect, face_shapes, faces_in
from smokelift.velocity.estimator import refine_in_box

MIN_SLAB_VOXELS = 4_000_000
"""Voxels of a box around smoke above which it is cut into slabs, each as narrow as the smoke is there."""

SLAB = 64
"""Voxels across a slab: many more than smoke moves in a step."""


def advect_near(density: Array, velocity: Velocity, dt: float, voxel_size: float, *, conserve: bool = False) -> Array:
    """Carry a density (nx, ny, nz), not negative, along by a velocity of its grid or of one that was halved from it.

    It gives what `advect` makes of it with `refine`, but for rounding. ``dt`` is in seconds, ``voxel_size`` of the
    density in meters; ``conserve`` is that of `advect`.
    """
    x, y, z = density.shape
    result = np.zeros(density.shape, np.float32)
    for box, source in _boxes(density > 0, _reach(velocity, dt / voxel_size), whole=conserve):
        along = refine_in_box(velocity, (x, y, z), source)
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
        part = refine_in_box(velocity, (x, y, z), box)
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
