# mypy: ignore-errors
# Taichi compiles this file: its annotations are no Python types, so there is nothing for mypy to check.
"""The camera pass and its adjoint for a GPU: the same sums as in ``cpp/camera.cpp``, one thread per ray.

Voxels are laid out as in ``light_kernels``. On the way back every voxel gathers from the rays that pass it, so that
nothing is atomic.
"""

import taichi as ti

from smokelift.render.gpu.light_kernels import affine, cell, hat, integers3, ndarray2, ndarray3, ndarray4, planar


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
