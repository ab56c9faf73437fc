"""Velocities on small boxes, and the ways to close their sides."""

import itertools

import numpy as np

from smokelift.scene import SIDES
from smokelift.transport import Velocity

SHAPE = (13, 10, 17)
ALL_SIDES = list(itertools.product([False, True], repeat=6))


def random_faces(rng, shape=SHAPE, scale=1.0):
    zero = Velocity.zero(shape, 1.0).faces
    return tuple((scale * rng.standard_normal(a.shape)).astype(np.float32) for a in zero)


def random_velocity(seed, scale=1.0, voxel_size=1.0, shape=SHAPE):
    return Velocity(random_faces(np.random.default_rng(seed), shape, scale), voxel_size)


def uniform(motion, shape=SHAPE, voxel_size=1.0):
    zero = Velocity.zero(shape, voxel_size).faces
    return Velocity(tuple(np.full_like(a, v) for a, v in zip(zero, motion, strict=True)), voxel_size)


def names(flags):
    return tuple(side for side, flag in zip(SIDES, flags, strict=True) if flag)
