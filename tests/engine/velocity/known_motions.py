"""Structured smoke that moves or turns as a whole, and how near an estimate comes."""

import numpy as np

from smokelift.transport import Velocity, face_shapes

SHAPE = (32, 28, 40)
DT, VOXEL = 1 / 24, 0.03

LARGE = {"shape": (48, 48, 48), "radius": 10.5}
"""For what moves as a whole and without noise: the default weights are those of turbulent smoke."""


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
    """Two densities about the middle of the box, and the displacement between them, in voxels."""
    motion, where = np.array(motion), positions(shape)
    before, after = (
        structured_density(*(a - half * m for a, m in zip(where, motion, strict=True)), radius) for half in (-0.5, 0.5)
    )
    return before, after, np.broadcast_to(motion, (*shape, 3))


def rotation(angle, shape=SHAPE, radius=6.0, before=0.0):
    """A turn about the middle, after one of another angle; displacement at arrival."""
    x, y, z = positions(shape)

    def turned(by):
        c, s = np.cos(by), np.sin(by)
        return c * x + s * z, c * z - s * x

    densities = [structured_density(a, y, b, radius) for a, b in (turned(before), turned(before + angle))]
    from_x, from_z = turned(angle)
    return *densities, np.stack([x - from_x, 0 * y, z - from_z], axis=-1)


def uniform(motion, shape=SHAPE):
    """The same velocity everywhere, in voxels per frame."""
    return Velocity([np.full(n, v * VOXEL / DT) for n, v in zip(face_shapes(shape), motion, strict=True)], VOXEL)


def voxels_per_frame(velocity):
    """At voxel centers."""
    return velocity.centres() * (DT / VOXEL)


def mean_motion(velocity, density):
    """Voxels a frame of the smoke as a whole."""
    return np.average(voxels_per_frame(velocity).reshape(-1, 3), axis=0, weights=density.ravel())


def error_in_smoke(velocity, density, displacement):
    """Relative, inside the smoke."""
    inside = density > 0.1 * density.max()
    wanted = np.broadcast_to(displacement, (*density.shape, 3))[inside]
    return np.linalg.norm(voxels_per_frame(velocity)[inside] - wanted) / np.linalg.norm(wanted)
