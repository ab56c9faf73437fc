"""Densities and velocities on grids that are each half as fine as the one before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smokelift import _core
from smokelift.transport import Array, Faces, face_shapes


@dataclass(frozen=True)
class Level:
    """One grid of the pyramid.

    Attributes
    ----------
    before, after : (nx, ny, nz) float32
        The densities.
    weight : (nx, ny, nz) float32
        How far changes may be taken for motion, as far as it is known beforehand.
    prediction
        In voxels per frame of this grid, on faces.
    coarseness
        Voxels of the finest grid along one of this.
    """

    before: Array
    after: Array
    weight: Array
    prediction: Faces
    coarseness: float = 1.0


def pyramid(finest: Level, levels: int) -> list[Level]:
    """Grids from the coarsest, which is left with at least eight voxels a side, to the given one."""
    result = [finest]
    while len(result) < levels and min(result[0].before.shape) >= 16:
        last = result[0]
        coarser = Level(
            _halve(last.before),
            _halve(last.after),
            _halve(last.weight),
            _halve_faces(last.prediction),
            2 * last.coarseness,
        )
        result.insert(0, coarser)
    return result


def refine(u: Faces, shape: tuple[int, ...], closed: list[bool], threads: int) -> Faces:
    """A velocity on the next finer grid, in its voxels, without divergence."""
    fine = []
    for axis, (component, target) in enumerate(zip(u, face_shapes(shape), strict=True)):
        for direction in range(3):
            # Faces coincide along their own axis; centres lie a quarter of a coarse voxel off.
            shift = 0.0 if direction == axis else -0.25
            component = _interpolate(component, direction, target[direction], shift)
        fine.append(2 * component)
    (x, y, z), _ = _core.project(fine, closed, passes=1, threads=threads)
    return x, y, z


def _interpolate(a: Array, axis: int, count: int, shift: float) -> Array:
    """Values at i/2 + shift, i = 0 ... count-1, along one axis; linear, the ends continued."""
    position = np.clip(np.arange(count) / 2 + shift, 0, a.shape[axis] - 1)
    low = np.minimum(position.astype(int), max(a.shape[axis] - 2, 0))
    high = np.minimum(low + 1, a.shape[axis] - 1)
    weight = (position - low).astype(np.float32).reshape([-1 if d == axis else 1 for d in range(3)])
    mixed: Array = a.take(low, axis) * (1 - weight) + a.take(high, axis) * weight
    return mixed


def _halve(a: Array, axes: tuple[int, ...] = (0, 1, 2)) -> Array:
    """Means of two along the given axes; an odd last one counts twice."""
    for axis in axes:
        if a.shape[axis] % 2:
            a = np.concatenate([a, a.take([-1], axis)], axis)
        shape = (*a.shape[:axis], a.shape[axis] // 2, 2, *a.shape[axis + 1 :])
        a = a.reshape(shape).mean(axis + 1, dtype=np.float32)
    return a


def _halve_faces(u: Faces) -> Faces:
    """A velocity on the next coarser grid, in its voxels."""
    coarse = []
    for axis, component in enumerate(u):
        across = tuple(d for d in range(3) if d != axis)
        cells = component.shape[axis] - 1
        every_second = np.minimum(np.arange((cells + 1) // 2 + 1) * 2, cells)
        coarse.append(np.float32(0.5) * _halve(component.take(every_second, axis), across))
    x, y, z = coarse
    return x, y, z
