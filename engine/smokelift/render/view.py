# mypy: ignore-errors
# Taichi compiles what stands here; its annotations are no Python types.
"""The camera pass and its adjoint.

The medium is packed as two values a voxel: extinction kappa (1/m) and in-scattered radiance J (for unit irradiance).
Both are sampled bilinearly in planes of voxels (see rays); around the grid lies a border where kappa is zero and J
that of the nearest voxel. A sample stands for a step of length d with constant kappa and J (method section 1):

    a_s = 1 - exp(-kappa_s d),   S = sum_s tau_s a_s J_s,   tau_s+1 = tau_s (1 - a_s).

The adjoint runs from back to front with R, the radiance that arrives from behind a sample (not yet attenuated):
nothing is ever divided by a vanishing transmittance, so gradients keep their relative accuracy deep inside.

    dS/dkappa_s = d tau_s+1 (J_s - R_s+1),   dS/dJ_s = tau_s a_s,   R_s = a_s J_s + (1 - a_s) R_s+1
"""

import taichi as ti

from smokelift.render.light import cell, mask3, ndarray3, planar

ndarray2 = ti.types.ndarray(dtype=ti.f32, ndim=2)
ndarray4 = ti.types.ndarray(dtype=ti.f32, ndim=4)
planes_type = ti.types.ndarray(dtype=ti.i32, ndim=3)


@ti.kernel
def pack(
    density: ndarray3,
    inscatter: ndarray3,
    near: mask3,
    medium: ndarray4,
    extinction: ti.f32,
    scatters: ti.i32,
):
    """medium[1 + index] = (kappa, J) in and next to voxels that may hold smoke, with the border."""
    size = ti.Vector([density.shape[0], density.shape[1], density.shape[2]])
    for index in ti.grouped(ti.ndrange(*density.shape)):
        if near[index] != 0:
            i, j, k = index[0] + 1, index[1] + 1, index[2] + 1
            medium[i, j, k, 0] = extinction * density[index]
            if scatters != 0:
                medium[i, j, k, 1] = inscatter[index]
                if any(index == 0) or any(index == size - 1):
                    _continue_into_border(medium, index, size, inscatter[index])


@ti.func
def _continue_into_border(medium: ti.template(), index, size, value):
    low = ti.Vector([ti.select(index[a] == 0, -1, 0) for a in ti.static(range(3))])
    high = ti.Vector([ti.select(index[a] == size[a] - 1, 2, 1) for a in ti.static(range(3))])
    for offset in ti.grouped(ti.ndrange((low[0], high[0]), (low[1], high[1]), (low[2], high[2]))):
        at = index + offset + 1
        medium[at[0], at[1], at[2], 1] = value


@ti.func
def _at(medium: ti.template(), index):
    i, j, k = index[0] + 1, index[1] + 1, index[2] + 1
    return ti.Vector([medium[i, j, k, 0], medium[i, j, k, 1]])


@ti.func
def _opacity(x):
    """1 - exp(-x), exact to rounding for thin steps too."""
    value = x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0))))
    if x > 0.04:
        value = 1.0 - ti.exp(-x)
    return value


@ti.kernel
def march(
    medium: ndarray4,
    lines: ndarray3,
    length: ndarray2,
    planes: planes_type,
    scattered: ndarray2,
    depth: ndarray2,
    record: ndarray4,
    axis: ti.template(),
    keep_record: ti.template(),
):
    """Scattered radiance (for unit irradiance) and optical depth of every ray with this dominant axis.

    With ``keep_record`` the samples (kappa, J) stay in record[plane, row, column] for `march_adjoint`.
    """
    for row, column in ti.ndrange(lines.shape[0], lines.shape[1]):
        if planes[row, column, 0] == axis:
            travel = planes[row, column, 1]
            first = planes[row, column, 2]
            last = planes[row, column, 3]
            d = length[row, column]
            tau = 1.0
            radiance = 0.0
            total = 0.0
            for step in range(last - first + 1):
                k = first + step if travel > 0 else last - step
                b = lines[row, column, 0] + lines[row, column, 1] * k
                c = lines[row, column, 2] + lines[row, column, 3] * k
                i = ti.floor(b, ti.i32)
                j = ti.floor(c, ti.i32)
                f = b - i
                g = c - j
                sample = (1 - f) * (
                    (1 - g) * _at(medium, cell(axis, k, i, j)) + g * _at(medium, cell(axis, k, i, j + 1))
                ) + f * ((1 - g) * _at(medium, cell(axis, k, i + 1, j)) + g * _at(medium, cell(axis, k, i + 1, j + 1)))
                x = sample[0] * d
                if x > 0:
                    opacity = _opacity(x)
                    radiance += tau * opacity * sample[1]
                    tau *= 1.0 - opacity
                    total += x
                if ti.static(keep_record):
                    record[k, row, column, 0] = sample[0]
                    record[k, row, column, 1] = sample[1]
            scattered[row, column] = radiance
            depth[row, column] = total


@ti.kernel
def march_adjoint(
    record: ndarray4,
    length: ndarray2,
    planes: planes_type,
    depth: ndarray2,
    scattered_gradient: ndarray2,
    transmittance_gradient: ndarray2,
):
    """Turn the recorded samples (kappa, J) into the derivatives of the loss with respect to them, in place."""
    for row, column in ti.ndrange(length.shape[0], length.shape[1]):
        travel = planes[row, column, 1]
        first = planes[row, column, 2]
        last = planes[row, column, 3]
        d = length[row, column]
        of_scattered = scattered_gradient[row, column]
        behind = transmittance_gradient[row, column]
        before = depth[row, column]  # optical depth from the camera to the back of the sample
        for step in range(last - first + 1):
            k = last - step if travel > 0 else first + step
            x = record[k, row, column, 0] * d
            glow = of_scattered * record[k, row, column, 1]
            opacity = _opacity(x)
            before = ti.max(before - x, 0.0)
            tau = ti.exp(-before)
            record[k, row, column, 0] = d * tau * (1.0 - opacity) * (glow - behind)
            record[k, row, column, 1] = tau * opacity * of_scattered
            behind = opacity * glow + (1.0 - opacity) * behind


@ti.kernel
def gather_gradient(
    record: ndarray4,
    lines: ndarray3,
    planes: planes_type,
    to_pixel: ti.types.matrix(3, 4, ti.f32),
    near: mask3,
    inscatter: ndarray3,
    gradient: ndarray3,
    depth_gradient: ndarray3,
    extinction: ti.f32,
    axis: ti.template(),
    shadows: ti.i32,
):
    """Add dL / d density by the direct path, and dL / d (optical depth to the light), for rays of one axis.

    ``near`` marks the voxels that a sample in smoke can touch: those that may hold smoke, and their neighbours.
    A voxel collects the samples of its plane whose bilinear footprint covers it: those in the pixels' bounding box
    of its footprint. No two voxels write to the same place, so there is nothing atomic.
    """
    rows, columns = lines.shape[0], lines.shape[1]
    size = planar(axis, ti.Vector([gradient.shape[0], gradient.shape[1], gradient.shape[2]]))
    for index in ti.grouped(ti.ndrange(*gradient.shape)):
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
            first_column = ti.floor(ti.min(ti.max(low_x - 0.51, -1.0), columns + 1.0), ti.i32)
            first_row = ti.floor(ti.min(ti.max(low_y - 0.51, -1.0), rows + 1.0), ti.i32)
            last_column = ti.min(columns - 1, ti.ceil(ti.max(ti.min(high_x - 0.49, columns + 1.0), -2.0), ti.i32))
            last_row = ti.min(rows - 1, ti.ceil(ti.max(ti.min(high_y - 0.49, rows + 1.0), -2.0), ti.i32))
            of_kappa = 0.0
            of_inscatter = 0.0
            for row in range(ti.max(first_row, 0), last_row + 1):
                for column in range(ti.max(first_column, 0), last_column + 1):
                    if planes[row, column, 0] == axis and planes[row, column, 2] <= k and k <= planes[row, column, 3]:
                        b = lines[row, column, 0] + lines[row, column, 1] * k
                        c = lines[row, column, 2] + lines[row, column, 3] * k
                        of_kappa += _hat(b - i) * _hat(c - j) * record[k, row, column, 0]
                        if shadows != 0:  # J goes on as the nearest voxel's in the border
                            b = ti.min(ti.max(b, 0.0), size[1] - 1.0)
                            c = ti.min(ti.max(c, 0.0), size[2] - 1.0)
                            of_inscatter += _hat(b - i) * _hat(c - j) * record[k, row, column, 1]
            gradient[index] += extinction * of_kappa
            if shadows != 0:
                # dJ / d(optical depth) = -J
                depth_gradient[index] -= inscatter[index] * of_inscatter


@ti.func
def _hat(distance):
    return ti.max(1.0 - ti.abs(distance), 0.0)
