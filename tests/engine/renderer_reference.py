"""The renderer's discrete sums once more, in float64 and plain NumPy, from method.md and not from the kernels.

Slow and simple: loops over planes, every ray at once. It also takes complex densities, so that derivatives can be had
by a complex step, Im f(x + i e) / e, which has no rounding error: deep in thick smoke derivatives are far below what
differences of two pictures can resolve.
"""

import numpy as np

from smokelift.render.rays import ray_through_pixels


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


def render(density, camera, domain, medium, sun, background, scattering="single"):
    """Image (rows, columns, 3), in the precision of the density: float64 or complex128."""
    h = domain.voxel_size
    kappa = medium.extinction * density
    origin, direction = ray_through_pixels(camera)
    inscatter = np.zeros_like(kappa)
    if scattering != "absorption" and sun is not None:
        travel = np.array(sun.direction) / np.linalg.norm(sun.direction)
        centres = np.stack(np.meshgrid(*[np.arange(n) for n in density.shape], indexing="ij"), -1) + 0.5
        centres = np.array(domain.min) + centres * h
        matrix = np.array(camera.matrix)
        to_eye = (
            matrix[:3, 3] - centres if camera.type == "perspective" else np.broadcast_to(matrix[:3, 2], centres.shape)
        )
        cosine = (to_eye @ travel) / np.linalg.norm(to_eye, axis=-1)
        g = medium.anisotropy
        phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
        light = np.exp(-light_optical_depth(kappa, h, travel)) if scattering == "single" else 1.0
        inscatter = medium.albedo * phase * light
    start = (origin - np.array(domain.min)) / h - 0.5
    rows, columns = direction.shape[:2]
    scattered, total = (np.zeros((rows, columns), density.dtype) for _ in range(2))
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
            tau, radiance = np.ones(d.shape, density.dtype), np.zeros(d.shape, density.dtype)
            for k in range(k_field.shape[0])[::sign]:
                b, c = base[:, 0] + lateral[:, 0] * k, base[:, 1] + lateral[:, 1] * k
                visible = np.ones(d.shape, bool)
                if camera.type == "perspective":
                    visible = (k - start[mine][:, axis]) * sign > 0
                x = np.where(visible, _interpolate(k_field[k], b, c), 0) * d
                nearest = [np.clip(at, 0, n - 1) for at, n in zip((b, c), j_field.shape[1:], strict=True)]
                opacity = -np.expm1(-x)
                radiance += tau * opacity * _interpolate(j_field[k], *nearest)
                tau = tau * (1 - opacity)
            scattered[mine], total[mine] = radiance, tau
    return scattered[..., None] * np.array(sun.irradiance if sun else (0, 0, 0)) + total[..., None] * background
