# mypy: ignore-errors
# Taichi compiles this file: its annotations are no Python types, so there is nothing for mypy to check.
"""Kernels for a GPU: the same sums as in ``cpp/parallel_light.cpp``, ``cpp/point_light.cpp`` and ``cpp/camera.cpp``.

Voxels are [x + 1, y + 1, z + 1, channel] with a border of one; the channels are extinction and in-scattered radiance J,
or derivatives by these. Columns are the light's rays, kept where they meet the planes across its axis. A parallel
light's column p meets plane k at p + slope k, so slot i of a plane of n voxels lies at i - 1 + frac(slope k) and there
are n + 1 of them. A point light's column p has the slope p / far. The camera pass takes one thread per ray.

Nothing is atomic: adjoints gather. On the way back every voxel gathers from the rays that pass it.
"""

import numpy as np

from smokelift.render.plan import CLOSEST
from smokelift.render.taichi_runtime import ti

ndarray2 = ti.types.ndarray(dtype=ti.f32, ndim=2)
ndarray3 = ti.types.ndarray(dtype=ti.f32, ndim=3)
ndarray4 = ti.types.ndarray(dtype=ti.f32, ndim=4)
integers3 = ti.types.ndarray(dtype=ti.i32, ndim=3)
vec3 = ti.types.vector(3, ti.f32)
vec2 = ti.types.vector(2, ti.f32)
affine = ti.types.matrix(3, 4, ti.f32)

Slopes = ti.types.struct(b=ti.f32, c=ti.f32, first=ti.i32)
"""The columns of a `ParallelSweep`."""

Rays = ti.types.struct(travel=ti.i32, first=ti.i32, far=ti.f32, begin=vec2, position=vec3)
"""The columns through a `Face` of a light at a position."""

Shading = ti.types.struct(energy=vec3, to_eye=affine, anisotropy=ti.f32, albedo=ti.f32)
"""A light's energy in three channels, and how a medium scatters it."""


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
def _value(values: ti.template(), axis: ti.template(), k, i, j):
    """A value of columns, or the first channel of voxels."""
    at = cell(axis, k, i, j)
    value = 0.0
    if ti.static(len(values.shape) == 3):  # noqa: SIM108 (Taichi compiles both parts of a conditional expression)
        value = values[at]
    else:
        value = values[at[0] + 1, at[1] + 1, at[2] + 1, 0]
    return value


@ti.func
def _bilinear(values: ti.template(), axis: ti.template(), k, i, j, f, g):
    """What lies fractions f and g behind (i, j) in a plane."""
    near = (1 - g) * _value(values, axis, k, i, j) + g * _value(values, axis, k, i, j + 1)
    return (1 - f) * near + f * (
        (1 - g) * _value(values, axis, k, i + 1, j) + g * _value(values, axis, k, i + 1, j + 1)
    )


@ti.func
def _scatter(
    source: ti.template(), result: ti.template(), index, shading, travel, spread, depth, add, adjoint: ti.template()
):
    """J = E p V, or J += E p V, of a voxel in the result; `spread` divides the energy, V = exp(-depth).

    p is albedo x Henyey-Greenstein, 1/sr, towards the camera; ``travel`` need not be normalized. The adjoint: the
    derivative by the optical depth to the light, -E p V dJ, in the result, from that by J in the source.
    """
    out = ti.Vector([0.0, 0.0, 0.0])
    for row in ti.static(range(3)):
        to_eye = shading.to_eye
        out[row] = to_eye[row, 0] * index[0] + to_eye[row, 1] * index[1] + to_eye[row, 2] * index[2] + to_eye[row, 3]
    anisotropy = shading.anisotropy
    g2 = anisotropy * anisotropy
    cosine = travel.dot(out) / ti.max(out.norm() * travel.norm(), 1e-20)
    base = ti.max(1.0 + g2 - 2.0 * anisotropy * cosine, 1e-6)
    lit = shading.albedo * (1.0 - g2) / (4.0 * np.pi * base * ti.sqrt(base)) / spread * ti.exp(-depth)
    i, j, k = index[0] + 1, index[1] + 1, index[2] + 1
    if ti.static(adjoint):
        value = 0.0
        for channel in range(1, source.shape[3]):
            value -= shading.energy[channel - 1] * lit * source[i, j, k, channel]
        result[i, j, k, 0] = value
    else:
        for channel in range(1, result.shape[3]):
            before = result[i, j, k, channel] if add != 0 else 0.0
            result[i, j, k, channel] = before + shading.energy[channel - 1] * lit


@ti.kernel
def accumulate_columns(voxels: ndarray4, columns: ndarray3, axis: ti.template(), travel: ti.i32, slopes: Slopes):
    """Columns = K S (first channel), in units of its value x planes."""
    size = _size(voxels, axis)
    planes, count_b, count_c = size[0], size[1], size[2]
    first, last = slopes.first, slopes.first + planes - 1
    begin_b, end_b = ti.floor(slopes.b * first, ti.i32), ti.floor(slopes.b * last, ti.i32)
    begin_c, end_c = ti.floor(slopes.c * first, ti.i32), ti.floor(slopes.c * last, ti.i32)
    total_b = count_b + 1 + ti.abs(end_b - begin_b)
    total_c = count_c + 1 + ti.abs(end_c - begin_c)
    for column_b, column_c in ti.ndrange(total_b, total_c):
        depth = 0.0
        for step in range(planes):
            k = step if travel > 0 else planes - 1 - step
            b, c = slopes.b * (first + k), slopes.c * (first + k)
            shift_b, shift_c = ti.floor(b, ti.i32), ti.floor(c, ti.i32)
            i = column_b - ti.max(begin_b, end_b) + shift_b
            j = column_c - ti.max(begin_c, end_c) + shift_c
            if 0 <= i <= count_b and 0 <= j <= count_c:
                value = _bilinear(voxels, axis, k, i - 1, j - 1, b - shift_b, c - shift_c)
                columns[cell(axis, k, i, j)] = depth + 0.5 * value
                depth += value


@ti.func
def _parallel_at_voxel(columns: ti.template(), axis: ti.template(), slopes, index):
    """(S' columns) at one voxel."""
    kij = planar(axis, index)
    b, c = slopes.b * (slopes.first + kij[0]), slopes.c * (slopes.first + kij[0])
    return _bilinear(columns, axis, kij[0], kij[1], kij[2], 1 - (b - ti.floor(b)), 1 - (c - ti.floor(c)))


@ti.kernel
def scatter_parallel(
    columns: ndarray3,
    near: integers3,
    source: ndarray4,
    result: ndarray4,
    axis: ti.template(),
    slopes: Slopes,
    step: ti.f32,
    direction: vec3,
    shading: Shading,
    add: ti.i32,
    adjoint: ti.template(),
):
    """Do `_scatter` in and next to voxels that may hold smoke."""
    for index in ti.grouped(ti.ndrange(*near.shape)):
        if near[index] != 0:
            depth = step * _parallel_at_voxel(columns, axis, slopes, index)
            _scatter(source, result, index, shading, direction, 1.0, depth, add, adjoint)


@ti.kernel
def add_parallel_shadow(
    columns: ndarray3, near: integers3, gradient: ndarray4, axis: ti.template(), slopes: Slopes, step: ti.f32
):
    """Extinction's gradient += step S' columns, with the columns of the reversed sweep of `scratch`."""
    for index in ti.grouped(ti.ndrange(*near.shape)):
        if near[index] != 0:
            shadow = step * _parallel_at_voxel(columns, axis, slopes, index)
            gradient[index[0] + 1, index[1] + 1, index[2] + 1, 0] += shadow


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
def _point_at_voxel(columns: ti.template(), axis: ti.template(), rays, index):
    """Optical depth of a voxel, bilinear between the columns around it."""
    kij, light = planar(axis, index), planar(axis, rays.position)
    scale = rays.far / (rays.travel * (kij[0] - light[0]))
    b, c = (kij[1] - light[1]) * scale, (kij[2] - light[2]) * scale
    p, q = ti.floor(b, ti.i32), ti.floor(c, ti.i32)
    row, column = p - ti.cast(rays.begin[0], ti.i32), q - ti.cast(rays.begin[1], ti.i32)
    return _bilinear(columns, 0, rays.travel * (kij[0] - rays.first), row, column, b - p, c - q)


@ti.kernel
def accumulate_rays(
    voxels: ndarray4, columns: ndarray3, axis: ti.template(), rays: Rays, voxel_size: ti.f32, adjoint: ti.template()
):
    """Columns[plane, p, q] = K S (first channel): optical depths along the rays of one face of a point light.

    The adjoint is K' T' of that: of interpolating between the columns and of summing along them.
    """
    size = _size(voxels, axis)
    light = planar(axis, rays.position)
    for row, column in ti.ndrange(columns.shape[1], columns.shape[2]):
        p, q = row + rays.begin[0], column + rays.begin[1]
        step = voxel_size * ti.sqrt(1.0 + (p * p + q * q) / (rays.far * rays.far))
        total = 0.0
        for count in range(columns.shape[0]):
            number = count
            if ti.static(adjoint):
                number = columns.shape[0] - 1 - count
            k = rays.first + rays.travel * number
            scale = rays.travel * (k - light[0]) / rays.far
            b, c = light[1] + p * scale, light[2] + q * scale
            value = 0.0
            if ti.static(adjoint):
                first_j, last_j = ti.ceil(c - scale, ti.i32), ti.floor(c + scale, ti.i32)
                for i in range(
                    ti.max(0, ti.ceil(b - scale, ti.i32)), ti.min(size[1] - 1, ti.floor(b + scale, ti.i32)) + 1
                ):
                    for j in range(ti.max(0, first_j), ti.min(size[2] - 1, last_j) + 1):
                        value += hat((i - b) / scale) * hat((j - c) / scale) * _value(voxels, axis, k, i, j)
            else:
                i, j = ti.floor(b, ti.i32), ti.floor(c, ti.i32)
                if -1 <= i < size[1] and -1 <= j < size[2]:
                    value = _bilinear(voxels, axis, k, i, j, b - i, c - j)
            columns[number, row, column] = step * (total + 0.5 * value)
            total += value


@ti.kernel
def scatter_point(
    columns: ndarray3,
    near: integers3,
    source: ndarray4,
    result: ndarray4,
    axis: ti.template(),
    rays: Rays,
    shading: Shading,
    add: ti.i32,
    adjoint: ti.template(),
):
    """Do `scatter_parallel` for the voxels seen through one face; others have the derivative 0."""
    for index in ti.grouped(ti.ndrange(*near.shape)):
        if near[index] != 0:
            away = index - rays.position
            if rays.travel * away[axis] >= CLOSEST and _owned(axis, away):
                depth = _point_at_voxel(columns, axis, rays, index)
                _scatter(source, result, index, shading, away, away.norm_sqr(), depth, add, adjoint)
            elif ti.static(adjoint):
                result[index[0] + 1, index[1] + 1, index[2] + 1, 0] = 0.0


@ti.kernel
def add_point_shadow(columns: ndarray3, near: integers3, gradient: ndarray4, axis: ti.template(), rays: Rays):
    """Extinction's gradient += S' columns: every voxel collects the columns that sample it."""
    light = planar(axis, rays.position)
    for index in ti.grouped(ti.ndrange(*near.shape)):
        kij = planar(axis, index)
        distance = rays.travel * (kij[0] - light[0])
        if near[index] != 0 and distance >= CLOSEST:
            scale = distance / rays.far
            b, c = (kij[1] - light[1]) / scale, (kij[2] - light[2]) / scale
            first_p = ti.max(0, ti.ceil(b - 1 / scale - rays.begin[0], ti.i32))
            last_p = ti.min(columns.shape[1] - 1, ti.floor(b + 1 / scale - rays.begin[0], ti.i32))
            first_q = ti.max(0, ti.ceil(c - 1 / scale - rays.begin[1], ti.i32))
            last_q = ti.min(columns.shape[2] - 1, ti.floor(c + 1 / scale - rays.begin[1], ti.i32))
            number = rays.travel * (kij[0] - rays.first)
            value = 0.0
            for row in range(first_p, last_p + 1):
                weight = hat((row + rays.begin[0] - b) * scale)
                for column in range(first_q, last_q + 1):
                    value += weight * hat((column + rays.begin[1] - c) * scale) * columns[number, row, column]
            gradient[index[0] + 1, index[1] + 1, index[2] + 1, 0] += value


@ti.kernel
def pack(density: ndarray3, marked: integers3, medium: ndarray4, extinction: ti.f32):
    """Extinction of the marked voxels from their density."""
    for i, j, k in ti.ndrange(*marked.shape):
        if marked[i, j, k] != 0:
            medium[i + 1, j + 1, k + 1, 0] = extinction * density[i, j, k]


@ti.kernel
def extend_into_border(medium: ndarray4):
    """In-scattered radiance of the border: the nearest voxel's."""
    size = ti.Vector([medium.shape[0] - 2, medium.shape[1] - 2, medium.shape[2] - 2])
    for index in ti.grouped(ti.ndrange(medium.shape[0], medium.shape[1], medium.shape[2])):
        nearest = ti.max(1, ti.min(index, size))
        if any(nearest != index):
            for channel in range(1, medium.shape[3]):
                medium[index[0], index[1], index[2], channel] = medium[nearest[0], nearest[1], nearest[2], channel]


@ti.func
def _opacity(x):
    """1 - exp(-x), exact to rounding for thin steps too: its Taylor series, of which x^5 / 120 is left out."""
    value = x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0))))
    if x > 0.04:
        value = 1.0 - ti.exp(-x)
    return value


@ti.kernel
def march(
    medium: ndarray4,
    lines: ndarray3,
    length: ndarray2,
    planes: integers3,
    scattered: ndarray3,
    depth: ndarray2,
    record: ndarray4,
    axis: ti.template(),
    channels: ti.template(),
    keep_record: ti.template(),
):
    """Scattered radiance and optical depth of every ray with this dominant axis.

    With ``keep_record`` the samples stay in record[plane, row, column, channel] for `march_adjoint`.
    """
    for row, column in ti.ndrange(lines.shape[0], lines.shape[1]):
        if planes[row, column, 0] == axis:
            travel = planes[row, column, 1]
            first = planes[row, column, 2]
            last = planes[row, column, 3]
            d = length[row, column]
            tau = 1.0
            radiance = ti.Vector([0.0] * (channels + 1))
            total = 0.0
            for step in range(last - first + 1):
                k = first + step if travel > 0 else last - step
                b = lines[row, column, 0] + lines[row, column, 1] * k
                c = lines[row, column, 2] + lines[row, column, 3] * k
                i = ti.floor(b, ti.i32)
                j = ti.floor(c, ti.i32)
                f = b - i
                g = c - j
                sample = ti.Vector([0.0] * (channels + 1))
                for corner in ti.static(range(4)):
                    at = cell(axis, k, i + corner // 2, j + corner % 2) + 1
                    weight = (f if corner // 2 else 1 - f) * (g if corner % 2 else 1 - g)
                    for channel in ti.static(range(channels + 1)):
                        sample[channel] += weight * medium[at[0], at[1], at[2], channel]
                x = sample[0] * d
                if x > 0:
                    opacity = _opacity(x)
                    radiance += tau * opacity * sample
                    tau *= 1.0 - opacity
                    total += x
                if ti.static(keep_record):
                    for channel in ti.static(range(channels + 1)):
                        record[k, row, column, channel] = sample[channel]
            for channel in ti.static(range(channels)):
                scattered[row, column, channel] = radiance[channel + 1]
            depth[row, column] = total


@ti.kernel
def march_adjoint(
    record: ndarray4,
    length: ndarray2,
    planes: integers3,
    depth: ndarray2,
    scattered_gradient: ndarray3,
    transmittance_gradient: ndarray2,
    channels: ti.template(),
):
    """Turn the recorded samples into the derivatives of the loss by them, in place."""
    for row, column in ti.ndrange(length.shape[0], length.shape[1]):
        travel = planes[row, column, 1]
        first = planes[row, column, 2]
        last = planes[row, column, 3]
        d = length[row, column]
        behind = transmittance_gradient[row, column]
        before = depth[row, column]  # optical depth from the camera to the back of the sample
        for step in range(last - first + 1):
            k = last - step if travel > 0 else first + step
            x = record[k, row, column, 0] * d
            inscattered = 0.0
            for channel in ti.static(range(channels)):
                inscattered += scattered_gradient[row, column, channel] * record[k, row, column, channel + 1]
            opacity = _opacity(x)
            before = ti.max(before - x, 0.0)
            tau = ti.exp(-before)
            record[k, row, column, 0] = d * tau * (1.0 - opacity) * (inscattered - behind)
            for channel in ti.static(range(channels)):
                record[k, row, column, channel + 1] = tau * opacity * scattered_gradient[row, column, channel]
            behind = opacity * inscattered + (1.0 - opacity) * behind


@ti.kernel
def gather_gradient(
    record: ndarray4,
    lines: ndarray3,
    planes: integers3,
    to_pixel: affine,
    near: integers3,
    gradient: ndarray4,
    axis: ti.template(),
    channels: ti.template(),
    add: ti.i32,
):
    """Derivatives by the voxels from those by the samples, for rays of one axis.

    ``near`` marks the voxels that a sample in smoke can touch: those that may hold smoke, and their neighbors.
    A voxel collects the samples of its plane whose bilinear footprint covers it: those in the pixels' bounding box
    of its footprint.
    """
    rows, columns = lines.shape[0], lines.shape[1]
    size = planar(axis, ti.Vector([near.shape[0], near.shape[1], near.shape[2]]))
    for index in ti.grouped(ti.ndrange(*near.shape)):
        if near[index] != 0:
            kij = planar(axis, index)
            k, i, j = kij[0], kij[1], kij[2]
            low_x, low_y, high_x, high_y = 1e9, 1e9, -1e9, -1e9
            for corner in ti.static(range(4)):
                at = cell(axis, k, i - 1 + 2 * (corner % 2), j - 1 + 2 * (corner // 2))
                p = ti.Vector([0.0, 0.0, 0.0])
                for m in ti.static(range(3)):
                    p[m] = to_pixel[m, 0] * at[0] + to_pixel[m, 1] * at[1] + to_pixel[m, 2] * at[2] + to_pixel[m, 3]
                # a corner behind the eye stands for one far out to its side
                w = ti.max(p[2], 1e-6)
                low_x, high_x = ti.min(low_x, p[0] / w), ti.max(high_x, p[0] / w)
                low_y, high_y = ti.min(low_y, p[1] / w), ti.max(high_y, p[1] / w)
            # pixel centers lie at halves; a hundredth of a pixel is for rounding
            first_column = ti.floor(ti.min(ti.max(low_x - 0.51, -1.0), columns + 1.0), ti.i32)
            first_row = ti.floor(ti.min(ti.max(low_y - 0.51, -1.0), rows + 1.0), ti.i32)
            last_column = ti.min(columns - 1, ti.ceil(ti.max(ti.min(high_x - 0.49, columns + 1.0), -2.0), ti.i32))
            last_row = ti.min(rows - 1, ti.ceil(ti.max(ti.min(high_y - 0.49, rows + 1.0), -2.0), ti.i32))
            value = ti.Vector([0.0] * (channels + 1))
            for row in range(ti.max(first_row, 0), last_row + 1):
                for column in range(ti.max(first_column, 0), last_column + 1):
                    if planes[row, column, 0] == axis and planes[row, column, 2] <= k and k <= planes[row, column, 3]:
                        b = lines[row, column, 0] + lines[row, column, 1] * k
                        c = lines[row, column, 2] + lines[row, column, 3] * k
                        value[0] += hat(b - i) * hat(c - j) * record[k, row, column, 0]
                        # J goes on as the nearest voxel's in the border
                        b = ti.min(ti.max(b, 0.0), size[1] - 1.0)
                        c = ti.min(ti.max(c, 0.0), size[2] - 1.0)
                        for channel in ti.static(range(1, channels + 1)):
                            value[channel] += hat(b - i) * hat(c - j) * record[k, row, column, channel]
            for channel in ti.static(range(channels + 1)):
                before = gradient[index[0] + 1, index[1] + 1, index[2] + 1, channel] if add != 0 else 0.0
                gradient[index[0] + 1, index[1] + 1, index[2] + 1, channel] = before + value[channel]


@ti.kernel
def unpack(gradient: ndarray4, marked: integers3, result: ndarray3, extinction: ti.f32):
    """Derivative by the density of the marked voxels."""
    for i, j, k in ti.ndrange(*marked.shape):
        result[i, j, k] = extinction * gradient[i + 1, j + 1, k + 1, 0] if marked[i, j, k] != 0 else 0.0
