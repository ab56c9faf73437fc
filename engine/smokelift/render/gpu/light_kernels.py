# mypy: ignore-errors
# Taichi compiles this file: its annotations are no Python types, so there is nothing for mypy to check.
"""Light sweeps for a GPU: the same sums as in ``cpp/parallel_light.cpp`` and ``cpp/point_light.cpp``.

Voxels are [x + 1, y + 1, z + 1, channel] with a border of one; the channels are extinction and in-scattered radiance J,
or derivatives by these. Columns are the light's rays, kept where they meet the planes across its axis. A parallel
light's column p meets plane k at p + slope k, so slot i of a plane of n voxels lies at i - 1 + frac(slope k) and there
are n + 1 of them. A point light's column p has the slope p / far.

Nothing is atomic: adjoints gather.
"""

import numpy as np
import taichi as ti

from smokelift.render.light_sweeps import CLOSEST

ndarray2 = ti.types.ndarray(dtype=ti.f32, ndim=2)
ndarray3 = ti.types.ndarray(dtype=ti.f32, ndim=3)
ndarray4 = ti.types.ndarray(dtype=ti.f32, ndim=4)
integers3 = ti.types.ndarray(dtype=ti.i32, ndim=3)
vec3 = ti.types.vector(3, ti.f32)
vec2 = ti.types.vector(2, ti.f32)
affine = ti.types.matrix(3, 4, ti.f32)


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
def hat(distance):
    """Weight of a bilinear look-up at a distance."""
    return ti.max(1.0 - ti.abs(distance), 0.0)


@ti.func
def _size(voxels: ti.template(), axis: ti.template()):
    return planar(axis, ti.Vector([voxels.shape[0] - 2, voxels.shape[1] - 2, voxels.shape[2] - 2]))


@ti.func
def _first_channel(voxels: ti.template(), axis: ti.template(), k, i, j):
    at = cell(axis, k, i, j) + 1
    return voxels[at[0], at[1], at[2], 0]


@ti.func
def phase(index, to_eye, travel, anisotropy, albedo):
    """Albedo x Henyey-Greenstein, 1/sr, towards the camera; ``travel`` need not be normalized."""
    out = ti.Vector([0.0, 0.0, 0.0])
    for row in ti.static(range(3)):
        out[row] = to_eye[row, 0] * index[0] + to_eye[row, 1] * index[1] + to_eye[row, 2] * index[2] + to_eye[row, 3]
    g2 = anisotropy * anisotropy
    cosine = travel.dot(out) / ti.max(out.norm() * travel.norm(), 1e-20)
    base = ti.max(1.0 + g2 - 2.0 * anisotropy * cosine, 1e-6)
    return albedo * (1.0 - g2) / (4.0 * np.pi * base * ti.sqrt(base))


@ti.func
def _write_inscatter(medium: ti.template(), index, energy, lit, add):
    i, j, k = index[0] + 1, index[1] + 1, index[2] + 1
    for channel in range(medium.shape[3] - 1):
        before = medium[i, j, k, channel + 1] if add != 0 else 0.0
        medium[i, j, k, channel + 1] = before + energy[channel] * lit


@ti.func
def _write_depth_gradient(gradient: ti.template(), result: ti.template(), index, energy, lit):
    """Derivative by the optical depth to the light: -E p V dJ."""
    i, j, k = index[0] + 1, index[1] + 1, index[2] + 1
    value = 0.0
    for channel in range(gradient.shape[3] - 1):
        value -= energy[channel] * lit * gradient[i, j, k, channel + 1]
    result[i, j, k, 0] = value


@ti.kernel
def accumulate_columns(
    voxels: ndarray4,
    columns: ndarray3,
    axis: ti.template(),
    travel: ti.i32,
    slope_b: ti.f32,
    slope_c: ti.f32,
    first: ti.i32,
):
    """Columns = K S (first channel), in units of its value x planes."""
    size = _size(voxels, axis)
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
                    (1 - g) * _first_channel(voxels, axis, k, i - 1, j - 1)
                    + g * _first_channel(voxels, axis, k, i - 1, j)
                ) + f * (
                    (1 - g) * _first_channel(voxels, axis, k, i, j - 1) + g * _first_channel(voxels, axis, k, i, j)
                )
                columns[cell(axis, k, i, j)] = depth + 0.5 * value
                depth += value


@ti.func
def parallel_at_voxel(columns: ti.template(), axis: ti.template(), slope_b, slope_c, first, index):
    """(S' columns) at one voxel."""
    kij = planar(axis, index)
    k, i, j = kij[0], kij[1], kij[2]
    f = slope_b * (first + k) - ti.floor(slope_b * (first + k))
    g = slope_c * (first + k) - ti.floor(slope_c * (first + k))
    return f * (g * columns[cell(axis, k, i, j)] + (1 - g) * columns[cell(axis, k, i, j + 1)]) + (1 - f) * (
        g * columns[cell(axis, k, i + 1, j)] + (1 - g) * columns[cell(axis, k, i + 1, j + 1)]
    )


@ti.kernel
def scatter_parallel(
    columns: ndarray3,
    near: integers3,
    source: ndarray4,
    result: ndarray4,
    axis: ti.template(),
    slope_b: ti.f32,
    slope_c: ti.f32,
    first: ti.i32,
    step: ti.f32,
    direction: vec3,
    energy: vec3,
    to_eye: affine,
    anisotropy: ti.f32,
    albedo: ti.f32,
    add: ti.i32,
    adjoint: ti.template(),
):
    """J = E p V, or J += E p V, in the result, in and next to voxels that may hold smoke.

    Its adjoint: from the derivative by J in the source that by the optical depth to the light, in the result.
    """
    for index in ti.grouped(ti.ndrange(*near.shape)):
        if near[index] != 0:
            lit = phase(index, to_eye, direction, anisotropy, albedo)
            lit *= ti.exp(-step * parallel_at_voxel(columns, axis, slope_b, slope_c, first, index))
            if ti.static(adjoint):
                _write_depth_gradient(source, result, index, energy, lit)
            else:
                _write_inscatter(result, index, energy, lit, add)


@ti.kernel
def add_parallel_shadow(
    columns: ndarray3,
    near: integers3,
    gradient: ndarray4,
    axis: ti.template(),
    slope_b: ti.f32,
    slope_c: ti.f32,
    first: ti.i32,
    step: ti.f32,
):
    """Extinction's gradient += step S' columns, with the columns of the reversed sweep of `scratch`."""
    for index in ti.grouped(ti.ndrange(*near.shape)):
        if near[index] != 0:
            gradient[index[0] + 1, index[1] + 1, index[2] + 1, 0] += step * parallel_at_voxel(
                columns, axis, slope_b, slope_c, first, index
            )


@ti.func
def _length(p, q, far):
    """Length of column (p, q) between two planes, in voxels."""
    return ti.sqrt(1.0 + (p * p + q * q) / (far * far))


@ti.func
def _owned(axis: ti.template(), away):
    """Whether a voxel lies farthest from the light along an axis, the first such axis; ``away`` from the light."""
    size = ti.abs(away)
    mine = True
    for other in ti.static(range(3)):
        if ti.static(other < axis):
            mine = mine and size[axis] > size[other]
        if ti.static(other > axis):
            mine = mine and size[axis] >= size[other]
    return mine


@ti.func
def faces_voxel(axis: ti.template(), travel, position, index):
    away = index - position
    return travel * away[axis] >= CLOSEST and _owned(axis, away)


@ti.func
def point_at_voxel(columns: ti.template(), axis: ti.template(), travel, first, far, begin, position, index):
    """Optical depth of a voxel, bilinear between the columns around it."""
    kij, light = planar(axis, index), planar(axis, position)
    number = travel * (kij[0] - first)
    scale = far / (travel * (kij[0] - light[0]))
    b, c = (kij[1] - light[1]) * scale, (kij[2] - light[2]) * scale
    p, q = ti.floor(b, ti.i32), ti.floor(c, ti.i32)
    f, g = b - p, c - q
    p -= ti.cast(begin[0], ti.i32)
    q -= ti.cast(begin[1], ti.i32)
    return (1 - f) * ((1 - g) * columns[number, p, q] + g * columns[number, p, q + 1]) + f * (
        (1 - g) * columns[number, p + 1, q] + g * columns[number, p + 1, q + 1]
    )


@ti.kernel
def accumulate_rays(
    medium: ndarray4,
    columns: ndarray3,
    axis: ti.template(),
    travel: ti.i32,
    first: ti.i32,
    far: ti.f32,
    begin: vec2,
    position: vec3,
    voxel_size: ti.f32,
):
    """Columns[plane, p, q] = K S extinction: optical depths along the rays of one face of a point light."""
    size = _size(medium, axis)
    light = planar(axis, position)
    for row, column in ti.ndrange(columns.shape[1], columns.shape[2]):
        p, q = row + begin[0], column + begin[1]
        step = voxel_size * _length(p, q, far)
        depth = 0.0
        for number in range(columns.shape[0]):
            k = first + travel * number
            scale = travel * (k - light[0]) / far
            b, c = light[1] + p * scale, light[2] + q * scale
            i, j = ti.floor(b, ti.i32), ti.floor(c, ti.i32)
            value = 0.0
            if -1 <= i < size[1] and -1 <= j < size[2]:
                f, g = b - i, c - j
                value = (1 - f) * (
                    (1 - g) * _first_channel(medium, axis, k, i, j) + g * _first_channel(medium, axis, k, i, j + 1)
                ) + f * (
                    (1 - g) * _first_channel(medium, axis, k, i + 1, j)
                    + g * _first_channel(medium, axis, k, i + 1, j + 1)
                )
            columns[number, row, column] = depth + 0.5 * step * value
            depth += step * value


@ti.kernel
def scatter_point(
    columns: ndarray3,
    near: integers3,
    source: ndarray4,
    result: ndarray4,
    axis: ti.template(),
    travel: ti.i32,
    first: ti.i32,
    far: ti.f32,
    begin: vec2,
    position: vec3,
    energy: vec3,
    to_eye: affine,
    anisotropy: ti.f32,
    albedo: ti.f32,
    add: ti.i32,
    adjoint: ti.template(),
):
    """Do `scatter_parallel` for the voxels seen through one face; others have the derivative 0."""
    for index in ti.grouped(ti.ndrange(*near.shape)):
        if near[index] != 0:
            if faces_voxel(axis, travel, position, index):
                away = index - position
                lit = phase(index, to_eye, away, anisotropy, albedo) / away.norm_sqr()
                lit *= ti.exp(-point_at_voxel(columns, axis, travel, first, far, begin, position, index))
                if ti.static(adjoint):
                    _write_depth_gradient(source, result, index, energy, lit)
                else:
                    _write_inscatter(result, index, energy, lit, add)
            elif ti.static(adjoint):
                result[index[0] + 1, index[1] + 1, index[2] + 1, 0] = 0.0


@ti.kernel
def gather_rays(
    scratch: ndarray4,
    columns: ndarray3,
    axis: ti.template(),
    travel: ti.i32,
    first: ti.i32,
    far: ti.f32,
    begin: vec2,
    position: vec3,
    voxel_size: ti.f32,
):
    """Columns = K' T' scratch: the adjoint of interpolating between the columns and of summing along them."""
    size = _size(scratch, axis)
    light = planar(axis, position)
    for row, column in ti.ndrange(columns.shape[1], columns.shape[2]):
        p, q = row + begin[0], column + begin[1]
        step = voxel_size * _length(p, q, far)
        behind = 0.0
        for back in range(columns.shape[0]):
            number = columns.shape[0] - 1 - back
            k = first + travel * number
            scale = travel * (k - light[0]) / far
            b, c = light[1] + p * scale, light[2] + q * scale
            value = 0.0
            for i in range(ti.max(0, ti.ceil(b - scale, ti.i32)), ti.min(size[1] - 1, ti.floor(b + scale, ti.i32)) + 1):
                for j in range(
                    ti.max(0, ti.ceil(c - scale, ti.i32)), ti.min(size[2] - 1, ti.floor(c + scale, ti.i32)) + 1
                ):
                    weight = hat((i - b) / scale) * hat((j - c) / scale)
                    value += weight * _first_channel(scratch, axis, k, i, j)
            columns[number, row, column] = step * (behind + 0.5 * value)
            behind += value


@ti.kernel
def add_point_shadow(
    columns: ndarray3,
    near: integers3,
    gradient: ndarray4,
    axis: ti.template(),
    travel: ti.i32,
    first: ti.i32,
    far: ti.f32,
    begin: vec2,
    position: vec3,
):
    """Extinction's gradient += S' columns: every voxel collects the columns that sample it."""
    light = planar(axis, position)
    for index in ti.grouped(ti.ndrange(*near.shape)):
        kij = planar(axis, index)
        distance = travel * (kij[0] - light[0])
        if near[index] != 0 and distance >= CLOSEST:
            scale = distance / far
            b, c = (kij[1] - light[1]) / scale, (kij[2] - light[2]) / scale
            first_p = ti.max(0, ti.ceil(b - 1 / scale - begin[0], ti.i32))
            last_p = ti.min(columns.shape[1] - 1, ti.floor(b + 1 / scale - begin[0], ti.i32))
            first_q = ti.max(0, ti.ceil(c - 1 / scale - begin[1], ti.i32))
            last_q = ti.min(columns.shape[2] - 1, ti.floor(c + 1 / scale - begin[1], ti.i32))
            number = travel * (kij[0] - first)
            value = 0.0
            for row in range(first_p, last_p + 1):
                weight = hat((row + begin[0] - b) * scale)
                for column in range(first_q, last_q + 1):
                    value += weight * hat((column + begin[1] - c) * scale) * columns[number, row, column]
            gradient[index[0] + 1, index[1] + 1, index[2] + 1, 0] += value
