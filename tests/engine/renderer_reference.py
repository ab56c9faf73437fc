"""The renderer's discrete sums once more, in float64 and plain NumPy, from method.md and not from the kernels.

Slow and simple: loops over planes, every ray at once. It also takes complex densities, so that derivatives can be had
by a complex step, Im f(x + i e) / e, which has no rounding error: deep in thick smoke derivatives are far below what
differences of two pictures can resolve.
"""

import numpy as np

from smokelift.scene.camera import ray_through_pixels


def _interpolate(plane, b, c):
    """Bilinear look-up in one plane, zero outside."""
    padded = np.pad(plane, 1)
    i, j = np.floor(b).astype(int), np.floor(c).astype(int)
    f, g = b - i, c - j
    inside = (i >= -1) & (i < plane.shape[0]) & (j >= -1) & (j < plane.shape[1])
    i, j = np.clip(i, -1, plane.shape[0] - 1) + 1, np.clip(j, -1, plane.shape[1] - 1) + 1
    value = (1 - f) * ((1 - g) * padded[i, j] + g * padded[i, j + 1]) + f * (
        (1 - g) * padded[i + 1, j] + g * padded[i + 1, j + 1]
    )
    return np.where(inside, value, 0.0)


def light_optical_depth(extinction, voxel_size, direction):
    """Optical depth from a parallel light to the voxels: columns through the planes, midpoint rule."""
    direction = np.asarray(direction, float)
    axis = int(np.argmax(np.abs(direction)))
    field = np.moveaxis(extinction, axis, 0)
    lateral = np.delete(direction, axis) / direction[axis]
    step = voxel_size * np.linalg.norm(direction) / abs(direction[axis])
    n, nb, nc = field.shape
    reach = np.ceil(np.abs(lateral) * n).astype(int) + 2
    p, q = np.meshgrid(np.arange(-reach[0], nb + reach[0]), np.arange(-reach[1], nc + reach[1]), indexing="ij")
    before = np.zeros(p.shape, field.dtype)
    out = np.zeros_like(field)
    order = range(n) if direction[axis] > 0 else range(n - 1, -1, -1)
    i, j = np.meshgrid(np.arange(nb), np.arange(nc), indexing="ij")
    for k in order:
        value = _interpolate(field[k], p + lateral[0] * k, q + lateral[1] * k) * step
        depth = before + value / 2
        out[k] = _interpolate(depth, i - lateral[0] * k + reach[0], j - lateral[1] * k + reach[1])
        before += value
    return np.moveaxis(out, 0, axis)


def point_optical_depth(extinction, voxel_size, position):
    """Optical depth from a point (grid coordinates) to the voxels, face by face of the cube around it."""
    position = np.asarray(position, float)
    out = np.zeros_like(extinction)
    index = np.stack(np.meshgrid(*map(np.arange, extinction.shape), indexing="ij"), -1)
    away = index - position
    face_of = np.argmax(np.abs(away), -1)  # the first axis where two are equally far
    for axis in range(3):
        field = np.moveaxis(extinction, axis, 0)
        lateral = np.delete(position, axis)
        for sign in (1, -1):
            ahead = [k for k in range(field.shape[0])[::sign] if sign * (k - position[axis]) >= 1e-3]
            if not ahead:
                continue
            far = sign * (ahead[-1] - position[axis])
            reach = int(np.ceil(far)) + 1
            distances = np.array([sign * (k - position[axis]) for k in ahead])
            columns = []
            for at, count in zip(lateral, field.shape[1:], strict=True):  # those that meet the grid
                slopes = np.stack([(-1 - at) / distances, (count - at) / distances]) * far
                columns.append(
                    np.arange(max(-reach, int(np.floor(slopes.min()))), min(reach, int(np.ceil(slopes.max()))) + 1)
                )
            if not all(map(len, columns)):
                continue  # no voxel is seen through this face
            p, q = np.meshgrid(*columns, indexing="ij")
            length = voxel_size * np.sqrt(1 + (p**2 + q**2) / far**2)
            before = np.zeros(p.shape, extinction.dtype)
            for k in ahead:
                distance = sign * (k - position[axis])
                scale = distance / far
                value = length * _interpolate(field[k], lateral[0] + scale * p, lateral[1] + scale * q)
                depth = before + value / 2
                before = before + value
                i, j = np.meshgrid(*map(np.arange, field.shape[1:]), indexing="ij")
                at_voxels = _interpolate(
                    depth, (i - lateral[0]) / scale - columns[0][0], (j - lateral[1]) / scale - columns[1][0]
                )
                mine = np.take(face_of, k, axis) == axis
                target = np.moveaxis(out, axis, 0)[k]
                target[mine] = at_voxels[mine]
    return out


def inscatter_of(kappa, camera, domain, medium, lights, scattering):
    """In-scattered radiance per unit extinction at the voxels, (nx, ny, nz, 3)."""
    h = domain.voxel_size
    total = np.zeros((*kappa.shape, 3), kappa.dtype)
    if scattering == "absorption":
        return total
    index = np.stack(np.meshgrid(*[np.arange(n) for n in kappa.shape], indexing="ij"), -1)
    centers = np.array(domain.min) + (index + 0.5) * h
    matrix = np.array(camera.matrix)
    to_eye = matrix[:3, 3] - centers if camera.type == "perspective" else np.broadcast_to(matrix[:3, 2], centers.shape)
    to_eye = to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)
    g = medium.anisotropy
    for light in lights:
        if hasattr(light, "position"):
            away = centers - np.array(light.position)
            distance = np.linalg.norm(away, axis=-1)
            travel = away / distance[..., None]
            energy = np.array(light.intensity) / distance[..., None] ** 2
            grid_position = (np.array(light.position) - np.array(domain.min)) / h - 0.5
            depth = point_optical_depth(kappa, h, grid_position)
        else:
            travel = np.array(light.direction) / np.linalg.norm(light.direction)
            energy = np.array(light.irradiance)
            depth = light_optical_depth(kappa, h, travel)
        cosine = np.sum(to_eye * travel, -1)
        phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
        shadow = np.ones_like(depth) if scattering == "unshadowed" else np.exp(-depth)
        total = total + np.array(medium.albedos) * (phase * shadow)[..., None] * energy
    return total + diffuse_inscatter(kappa, total, h, medium.albedos) if scattering == "multiple" else total


def diffuse_inscatter(kappa, inscatter, h, albedos):
    """What light that has been scattered adds to the in-scattered radiance, by a dense matrix over blocks of voxels."""
    size = min(max(round(max(kappa.shape) / 24), 2), 4)
    # the blocks reach around the voxels, so the first begins a block before the grid
    indices = [np.arange(-size, n + size) // size + 1 for n in kappa.shape]
    blocks = [int(index[-1]) + 1 for index in indices]
    inside = np.ix_(*(index[size:-size] for index in indices))
    places = [(np.arange(n) % size + 0.5) / size - 0.5 for n in kappa.shape]
    spread = np.mean(((np.arange(size) + 0.5) / size - 0.5) ** 2)
    weights = [np.ones(kappa.shape), *(place / spread for place in np.meshgrid(*places, indexing="ij"))]
    extinction = np.zeros(blocks, inscatter.dtype)
    np.add.at(extinction, inside, kappa / size**3)
    emission = np.zeros((4, *blocks, 3), inscatter.dtype)
    for field, weight in zip(emission, weights, strict=True):
        np.add.at(field, inside, (kappa * weight)[..., None] * inscatter / size**3)
    smoky = np.argwhere(extinction != 0)  # nothing else emits
    transport = block_transport(extinction, h * size, smoky)
    within = transport.reshape(4, *blocks, 4 * len(smoky))[(slice(None), *smoky.T)].reshape(4 * len(smoky), -1)
    scattering, emitted = np.tile(extinction[tuple(smoky.T)], 4), emission[(slice(None), *smoky.T)].reshape(-1, 3)
    channels = []
    for albedo, source in zip(albedos, emitted.T, strict=True):
        inner = np.linalg.solve(np.eye(len(within)) - within * (albedo * scattering), within @ source)
        channels.append(transport @ (source + albedo * scattering * inner))
    radiance = np.stack(channels, -1).reshape(4, *blocks, 3)
    positions = [(np.arange(n) + 0.5) / size + 0.5 for n in kappa.shape]
    total = np.zeros_like(inscatter)
    for corner in np.ndindex(2, 2, 2):
        numbers = [at.astype(int) + c for at, c in zip(positions, corner, strict=True)]
        apart = np.meshgrid(*(at - n for at, n in zip(positions, numbers, strict=True)), indexing="ij")
        near = radiance[(slice(None), *np.ix_(*numbers))]
        linear = near[0] + sum(d[..., None] * slope for d, slope in zip(apart, near[1:], strict=True))
        total += np.prod([1 - np.abs(d) for d in apart], axis=0)[..., None] * linear
    return np.array(albedos) * total


def block_transport(extinction, edge, smoky):
    """Matrix from the emission of smoky blocks to radiance: the mean and three slopes, along the lattice's lines.

    Along a beam the integrals over a block are sums at Gauss points.
    """
    blocks = extinction.shape
    transport = np.zeros((4, *blocks, 4, len(smoky)), extinction.dtype)
    points, weights = np.polynomial.legendre.leggauss(40)
    points, weights = (points + 1) / 2, weights / 2
    bases = np.stack([np.ones(40), points - 0.5])
    for direction in np.ndindex(3, 3, 3):
        step = np.array(direction) - 1
        axes = int(np.abs(step).sum())
        if axes not in (1, 3):
            continue
        weight, length = (1 / 15, edge) if axes == 1 else (3 / 40, edge * np.sqrt(3))
        across = [axis for axis in range(3) if not step[axis]]
        for number, begin in enumerate(map(tuple, smoky)):
            t = extinction[begin] * length
            leaving = length * (bases * weights) @ np.exp(-t * (1 - points))
            # within the block, from each point to those that lie farther
            farther = points[:, None] + (1 - points[:, None]) * points
            reached = weights[:, None] * (1 - points[:, None]) * weights * np.exp(-t * (farther - points[:, None]))
            own = length * np.stack([bases @ reached.sum(1), bases @ (reached * (farther - 0.5)).sum(1)])
            _add_beam(transport, begin, number, weight, own, step)
            for axis in across:
                transport[(1 + axis, *begin, 1 + axis, number)] += weight * own[0, 0]
            at = np.array(begin) + step
            while np.all(at >= 0) and np.all(at < blocks):
                to = tuple(at)
                depth = extinction[to] * length
                seen = (bases * weights) @ np.exp(-depth * points)
                _add_beam(transport, to, number, weight, np.outer(seen, leaving), step)
                for axis in across:
                    transport[(1 + axis, *to, 1 + axis, number)] += weight * seen[0] * leaving[0]
                leaving, at = leaving * np.exp(-depth), at + step
    return transport.reshape(4 * extinction.size, -1)


def _add_beam(transport, to, number, weight, moments, step):
    """Add what a beam brings of mean and rise to mean and rise; a rise is that of the slopes along the beam."""
    transport[(0, *to, 0, number)] += weight * moments[0, 0]
    transport[(0, *to, slice(1, 4), number)] += weight * moments[0, 1] * step
    transport[(slice(1, 4), *to, 0, number)] += 12 * weight * moments[1, 0] * step
    transport[(slice(1, 4), *to, slice(1, 4), number)] += 12 * weight * moments[1, 1] * np.outer(step, step)


def render(density, camera, domain, medium, lights, background, scattering="single"):
    """Image (rows, columns, 3), in the precision of the density: float64 or complex128."""
    h = domain.voxel_size
    kappa = medium.extinction * density
    origin, direction = ray_through_pixels(camera)
    inscatter = inscatter_of(kappa, camera, domain, medium, lights, scattering)
    start = (origin - np.array(domain.min)) / h - 0.5
    rows, columns = direction.shape[:2]
    total = np.zeros((rows, columns), density.dtype)
    scattered = np.zeros((rows, columns, 3), density.dtype)
    dominant = np.argmax(np.abs(direction), -1)
    for axis in range(3):
        k_field, j_field = np.moveaxis(kappa, axis, 0), np.moveaxis(inscatter, axis, 0)
        along = direction[..., axis]
        for sign in (1, -1):
            mine = (dominant == axis) & (along * sign > 0)
            if not mine.any():
                continue
            lateral = np.delete(direction[mine], axis, -1) / along[mine][:, None]
            base = np.delete(start[mine], axis, -1) - lateral * start[mine][:, axis][:, None]
            d = h / np.abs(along[mine])
            tau, radiance = np.ones(d.shape, density.dtype), np.zeros((*d.shape, 3), density.dtype)
            for k in range(k_field.shape[0])[::sign]:
                b, c = base[:, 0] + lateral[:, 0] * k, base[:, 1] + lateral[:, 1] * k
                visible = np.ones(d.shape, bool)
                if camera.type == "perspective":
                    visible = (k - start[mine][:, axis]) * sign > 0
                x = np.where(visible, _interpolate(k_field[k], b, c), 0) * d
                nearest = [np.clip(at, 0, n - 1) for at, n in zip((b, c), j_field.shape[1:3], strict=True)]
                opacity = -np.expm1(-x)
                glow = np.stack([_interpolate(j_field[k][..., m], *nearest) for m in range(3)], -1)
                radiance += (tau * opacity)[:, None] * glow
                tau = tau * (1 - opacity)
            scattered[mine], total[mine] = radiance, tau
    return scattered + total[..., None] * background


def complex_step(loss, density, voxel):
    """The derivative of a loss (density -> number) by one voxel, to rounding."""
    moved = density.astype(complex)
    moved[tuple(voxel)] += 1e-30j
    return loss(moved).imag / 1e-30
