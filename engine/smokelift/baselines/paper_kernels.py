# mypy: ignore-errors
# Taichi compiles this module: its annotations are no Python types.
"""The paper's light volume, algorithm 2 with its record, and algorithm 3; `paper_renderer` has the formulas.

Extinction is [x + 1, y + 1, z + 1, 0] with a border of one voxel, as the light sweeps read it. In-scattered radiance
is [x, y, z, value]: J of every channel, then J x way of the light of every channel. Positions are in voxels, voxel
centers at integers. Volumes are read trilinearly, and beyond the outermost centers as the nearest voxel, so that a
sample's weights always add up to one.
"""

from smokelift.render.gpu_kernels import integers3, ndarray2, ndarray3, ndarray4, vec3
from smokelift.render.taichi_runtime import ti


@ti.func
def _way(index, size, travel, voxel_size):
    """Length (m) of light's way in the box to a voxel."""
    shortest = 1e30
    for a in ti.static(range(3)):
        behind = index[a] + 0.5 if travel[a] > 0 else size[a] - 0.5 - index[a]
        shortest = ti.min(shortest, behind / ti.max(ti.abs(travel[a]), 1e-20))
    return voxel_size * shortest * travel.norm()


@ti.kernel
def add_light(
    lit: ndarray4,
    inscatter: ndarray4,
    light: vec3,
    parallel: ti.template(),
    voxel_size: ti.f32,
    channels: ti.template(),
    add: ti.i32,
):
    """Write, or ``add``, J = albedo p E V and J x way of one light, whose J is in the channels of ``lit``.

    ``light`` is the direction of parallel light, or the point that it comes from.
    """
    size = ti.Vector([inscatter.shape[0], inscatter.shape[1], inscatter.shape[2]])
    for index in ti.grouped(ti.ndrange(inscatter.shape[0], inscatter.shape[1], inscatter.shape[2])):
        travel = light
        if ti.static(not parallel):
            travel = index - light
        way = _way(index, size, travel, voxel_size)
        for c in ti.static(range(channels)):
            here = lit[index[0] + 1, index[1] + 1, index[2] + 1, c + 1]
            shadowed = here * way
            if add != 0:
                here += inscatter[index[0], index[1], index[2], c]
                shadowed += inscatter[index[0], index[1], index[2], channels + c]
            inscatter[index[0], index[1], index[2], c] = here
            inscatter[index[0], index[1], index[2], channels + c] = shadowed


@ti.func
def _cell(position, size):
    """The voxels below and above a position, and the fraction of the way between them."""
    low, high = ti.Vector([0, 0, 0]), ti.Vector([0, 0, 0])
    fraction = ti.Vector([0.0, 0.0, 0.0])
    for a in ti.static(range(3)):
        clamped = ti.min(ti.max(position[a], 0.0), size[a] - 1.0)
        low[a] = ti.floor(clamped, ti.i32)
        high[a] = ti.min(low[a] + 1, size[a] - 1)
        fraction[a] = clamped - low[a]
    return low, high, fraction


@ti.func
def _corner(low, high, fraction, corner: ti.template()):
    """One of the eight voxels around a position, and its weight."""
    index = ti.Vector([0, 0, 0])
    weight = 1.0
    for a in ti.static(range(3)):
        if ti.static((corner >> a) & 1):
            index[a] = high[a]
            weight *= fraction[a]
        else:
            index[a] = low[a]
            weight *= 1.0 - fraction[a]
    return index, weight


@ti.kernel
def march(
    extinction: ndarray4,
    inscatter: ndarray4,
    first: ndarray3,
    step: ndarray3,
    samples: integers3,
    position: ndarray2,
    grad: ndarray2,
    scattered: ndarray3,
    depth: ndarray2,
    per_density: ti.f32,
    d: ti.f32,
    shadows: ti.template(),
    channels: ti.template(),
):
    """Algorithm 2: the picture of every ray, and the terms of equation 9 in its part of the record.

    ``samples[row, column]`` holds where the ray's part begins and its number of samples, from the camera on.
    """
    size = ti.Vector([inscatter.shape[0], inscatter.shape[1], inscatter.shape[2]])
    for row, column in ti.ndrange(samples.shape[0], samples.shape[1]):
        begin, count = samples[row, column, 0], samples[row, column, 1]
        p = ti.Vector([first[row, column, 0], first[row, column, 1], first[row, column, 2]])
        along = ti.Vector([step[row, column, 0], step[row, column, 1], step[row, column, 2]])
        optical_depth = 0.0
        radiance = ti.Vector.zero(ti.f32, channels)
        for s in range(count):
            kappa = 0.0
            glow = ti.Vector.zero(ti.f32, 2 * channels)
            low, high, fraction = _cell(p, size)
            for corner in ti.static(range(8)):
                index, weight = _corner(low, high, fraction, corner)
                kappa += weight * extinction[index[0] + 1, index[1] + 1, index[2] + 1, 0]
                for m in ti.static(range(2 * channels if shadows else channels)):
                    glow[m] += weight * inscatter[index[0], index[1], index[2], m]
            tau = ti.exp(-optical_depth)
            # equation 8: tau' = -tau sigma_t (s d), kappa' = sigma_t; equation 10: J' = -sigma_t (J x way)
            reach = 1.0 - kappa * d * s
            for c in ti.static(range(channels)):
                radiance[c] += tau * kappa * glow[c] * d
                change = reach * glow[c]
                if ti.static(shadows):
                    change -= kappa * glow[channels + c]
                grad[begin + s, c] = per_density * tau * d * change
            for a in ti.static(range(3)):
                position[begin + s, a] = p[a]
            optical_depth += kappa * d
            p += along
        depth[row, column] = optical_depth
        for c in ti.static(range(channels)):
            scattered[row, column, c] = radiance[c]


@ti.kernel
def accumulate(
    position: ndarray2,
    grad: ndarray2,
    samples: integers3,
    of_scattered: ndarray3,
    of_every_sample: ndarray2,
    gradient: ndarray3,
    channels: ti.template(),
):
    """Algorithm 3, lines 5 to 13: densityGrad from the record, weighted with dloss / dL of each ray.

    ``of_every_sample[row, column]`` is what equation 7 gives to every sample of a ray.
    """
    size = ti.Vector([gradient.shape[0], gradient.shape[1], gradient.shape[2]])
    for row, column in ti.ndrange(samples.shape[0], samples.shape[1]):
        begin, count = samples[row, column, 0], samples[row, column, 1]
        for s in range(begin, begin + count):
            change = of_every_sample[row, column]
            for c in ti.static(range(channels)):
                change += of_scattered[row, column, c] * grad[s, c]
            p = ti.Vector([position[s, 0], position[s, 1], position[s, 2]])
            low, high, fraction = _cell(p, size)
            for corner in ti.static(range(8)):
                index, weight = _corner(low, high, fraction, corner)
                gradient[index] += weight * change
