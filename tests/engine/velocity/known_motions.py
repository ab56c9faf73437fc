"""Structured smoke that moves or turns as a whole, and how near an estimate comes."""

import numpy as np

SHAPE = (32, 28, 40)
DT, VOXEL = 1 / 24, 0.03


# For what moves as a whole and without noise: the default weights are those of turbulent smoke.
LARGE = {"shape": (48, 48, 48), "radius": 10.5}


def structured_density(x, y, z, radius=6.0):
    """A smooth blob, structured in all directions (else a turn could not be seen); arguments in voxels."""
    envelope = np.exp(-(x**2 + y**2 + z**2) / radius**2)
    waves = (
        np.sin(0.4 * x + 0.16 * y) * np.cos(0.32 * z)
        + np.cos(0.32 * y - 0.24 * z + 0.12 * x)
        + np.sin(0.36 * z + 0.08 * y - 0.12 * x)
    )
    return envelope * np.exp(0.6 * waves)


def positions(shape):
    """Voxels from the middle of the box."""
    return [i - (n - 1) / 2 for i, n in zip(np.indices(shape, dtype=float), shape, strict=True)]


def translation(motion, shape=SHAPE, radius=6.0):
    """Two densities and the displacement between them, in voxels."""
    x, y, z = positions(shape)
    after = structured_density(x - motion[0], y - motion[1], z - motion[2], radius)
    return structured_density(x, y, z, radius), after, np.broadcast_to(motion, (*shape, 3))


def rotation(angle, shape=SHAPE, radius=6.0):
    """A turn about the middle, displacement at arrival."""
    x, y, z = positions(shape)
    c, s = np.cos(angle), np.sin(angle)
    from_x, from_z = c * x + s * z, c * z - s * x
    after = structured_density(from_x, y, from_z, radius)
    return structured_density(x, y, z, radius), after, np.stack([x - from_x, 0 * y, z - from_z], axis=-1)


def error_in_smoke(velocity, density, displacement, dt=DT, voxel_size=VOXEL):
    inside = density > 0.1 * density.max()
    found = velocity.centres()[inside] * dt / voxel_size
    return np.linalg.norm(found - displacement[inside]) / np.linalg.norm(displacement[inside])
