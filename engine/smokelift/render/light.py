# mypy: ignore-errors
# Taichi compiles what stands here; its annotations are no Python types.
"""The light pass: optical depth from a parallel light to every voxel, by one sweep over the grid.

The grid is sheared so that every light ray is a column: column p meets plane k of the light's dominant axis at
lateral position p + slope k. The fractional part of slope k is the same for the whole plane, so both going from
voxels to columns (S) and back (its transpose) are bilinear with constant weights, and between them lies a
running sum along the columns (K, midpoint rule):

    optical depth at the voxels = S^T K S (extinction).

The transpose of the running sum is the running sum of the light that travels the other way, so the adjoint of the
sweep is the sweep for the reversed direction (method section 2, last line).

Columns are stored where they meet the planes: slot i of plane k lies at lateral position i - 1 + frac(slope k),
so a plane of n voxels has n + 1 slots and the storage is hardly larger than the grid, at any angle.
"""

from dataclasses import dataclass, replace

import numpy as np
import taichi as ti
from numpy.typing import NDArray

from smokelift.render.rays import LATERAL

ndarray3 = ti.types.ndarray(dtype=ti.f32, ndim=3)
mask3 = ti.types.ndarray(dtype=ti.i32, ndim=3)


@dataclass(frozen=True)
class Sweep:
    """A light direction in grid terms.

    Attributes
    ----------
    axis
        Dominant axis of the direction.
    travel
        +1 or -1 along it.
    slope
        Lateral shift a plane along the two other axes, in voxels, -1 to 1.
    length
        Length of the ray between two planes, in voxels.
    first
        Number of the first plane: where the grid is a part of a larger one, its columns are the larger one's.
    """

    axis: int
    travel: int
    slope: tuple[float, float]
    length: float
    first: int = 0

    @property
    def reversed(self) -> "Sweep":
        """The sweep of the light that travels the other way: the adjoint."""
        return replace(self, travel=-self.travel)


def light_sweep(direction: NDArray[np.float64], corner: tuple[int, int, int] = (0, 0, 0)) -> Sweep:
    """The sweep for a direction of travel (3,), not zero, over a grid that begins at a voxel of a larger one."""
    axis = int(np.argmax(np.abs(direction)))
    along = float(direction[axis])
    b, c = LATERAL[axis]
    return Sweep(
        axis=axis,
        travel=1 if along > 0 else -1,
        slope=(float(direction[b]) / along, float(direction[c]) / along),
        length=float(np.linalg.norm(direction)) / abs(along),
        first=corner[axis],
    )


def column_shape(shape: tuple[int, int, int], axis: int) -> tuple[int, int, int]:
    """Shape of the column storage for a grid."""
    x, y, z = (n + (a != axis) for a, n in enumerate(shape))
    return x, y, z


@ti.func
def cell(axis: ti.template(), k, i, j):
    """Grid index of plane k, lateral position (i, j)."""
    index = ti.Vector([k, i, j])
    if ti.static(axis == 1):
        index = ti.Vector([i, k, j])
    if ti.static(axis == 2):
        index = ti.Vector([i, j, k])
    return index


@ti.func
def planar(axis: ti.template(), index):
    """Plane k and lateral position (i, j) of a grid index: the inverse of `cell`."""
    kij = index
    if ti.static(axis == 1):
        kij = ti.Vector([index[1], index[0], index[2]])
    if ti.static(axis == 2):
        kij = ti.Vector([index[2], index[0], index[1]])
    return kij


@ti.func
def _voxel_value(field: ti.template(), axis: ti.template(), k, i, j, count_b, count_c):
    value = 0.0
    if 0 <= i < count_b and 0 <= j < count_c:
        value = field[cell(axis, k, i, j)]
    return value


@ti.kernel
def accumulate_columns(
    field: ndarray3,
    columns: ndarray3,
    axis: ti.template(),
    travel: ti.i32,
    slope_b: ti.f32,
    slope_c: ti.f32,
    first: ti.i32,
):
    """columns = K S field, in units of (value of the field) x planes."""
    size = planar(axis, ti.Vector([field.shape[0], field.shape[1], field.shape[2]]))
    planes, count_b, count_c = size[0], size[1], size[2]
    begin_b, end_b = ti.floor(slope_b * first, ti.i32), ti.floor(slope_b * (first + planes - 1), ti.i32)
    begin_c, end_c = ti.floor(slope_c * first, ti.i32), ti.floor(slope_c * (first + planes - 1), ti.i32)
    most_b, most_c = ti.max(begin_b, end_b), ti.max(begin_c, end_c)
    total_b = count_b + 1 + ti.abs(end_b - begin_b)
    total_c = count_c + 1 + ti.abs(end_c - begin_c)
    for column_b, column_c in ti.ndrange(total_b, total_c):
        depth = 0.0
        for step in range(planes):
            k = step if travel > 0 else planes - 1 - step
            shift_b = ti.floor(slope_b * (first + k), ti.i32)
            shift_c = ti.floor(slope_c * (first + k), ti.i32)
            i = column_b - most_b + shift_b
            j = column_c - most_c + shift_c
            if 0 <= i <= count_b and 0 <= j <= count_c:
                f = slope_b * (first + k) - shift_b
                g = slope_c * (first + k) - shift_c
                value = (1 - f) * (
                    (1 - g) * _voxel_value(field, axis, k, i - 1, j - 1, count_b, count_c)
                    + g * _voxel_value(field, axis, k, i - 1, j, count_b, count_c)
                ) + f * (
                    (1 - g) * _voxel_value(field, axis, k, i, j - 1, count_b, count_c)
                    + g * _voxel_value(field, axis, k, i, j, count_b, count_c)
                )
                columns[cell(axis, k, i, j)] = depth + 0.5 * value
                depth += value


@ti.func
def at_voxel(columns: ti.template(), axis: ti.template(), slope_b, slope_c, first, index):
    """(S^T columns) at one voxel."""
    kij = planar(axis, index)
    k, i, j = kij[0], kij[1], kij[2]
    f = slope_b * (first + k) - ti.floor(slope_b * (first + k))
    g = slope_c * (first + k) - ti.floor(slope_c * (first + k))
    return f * (g * columns[cell(axis, k, i, j)] + (1 - g) * columns[cell(axis, k, i, j + 1)]) + (1 - f) * (
        g * columns[cell(axis, k, i + 1, j)] + (1 - g) * columns[cell(axis, k, i + 1, j + 1)]
    )


@ti.kernel
def shade(
    columns: ndarray3,
    phase: ndarray3,
    near: mask3,
    inscatter: ndarray3,
    axis: ti.template(),
    slope_b: ti.f32,
    slope_c: ti.f32,
    first: ti.i32,
    optical_length: ti.f32,
):
    """inscatter = phase x V_l, V_l = exp(-optical depth to the light), in and next to voxels that may hold smoke."""
    for index in ti.grouped(ti.ndrange(*inscatter.shape)):
        if near[index] != 0:
            depth = optical_length * at_voxel(columns, axis, slope_b, slope_c, first, index)
            inscatter[index] = phase[index] * ti.exp(-depth)


@ti.kernel
def add_shadow_gradient(
    columns: ndarray3,
    support: mask3,
    gradient: ndarray3,
    axis: ti.template(),
    slope_b: ti.f32,
    slope_c: ti.f32,
    first: ti.i32,
    optical_length: ti.f32,
):
    """gradient += optical_length S^T columns, with the columns of the reversed sweep of dL / d(optical depth)."""
    for index in ti.grouped(ti.ndrange(*gradient.shape)):
        if support[index] != 0:
            gradient[index] += optical_length * at_voxel(columns, axis, slope_b, slope_c, first, index)


@ti.kernel
def fill_phase(
    phase: ndarray3,
    to_eye: ti.types.matrix(3, 4, ti.f32),
    light: ti.types.vector(3, ti.f32),
    anisotropy: ti.f32,
    albedo: ti.f32,
):
    """phase = albedo x Henyey-Greenstein phase function towards the camera, 1/sr.

    ``to_eye`` maps a voxel index to the (not normalised) direction towards the eye; ``light`` is the unit direction
    of travel.
    """
    g2 = anisotropy * anisotropy
    for index in ti.grouped(ti.ndrange(*phase.shape)):
        out = ti.Vector([0.0, 0.0, 0.0])
        for row in ti.static(range(3)):
            out[row] = (
                to_eye[row, 0] * index[0] + to_eye[row, 1] * index[1] + to_eye[row, 2] * index[2] + to_eye[row, 3]
            )
        cosine = light.dot(out) / ti.max(out.norm(), 1e-20)
        base = ti.max(1.0 + g2 - 2.0 * anisotropy * cosine, 1e-6)
        phase[index] = albedo * (1.0 - g2) / (4.0 * np.pi * base * ti.sqrt(base))
