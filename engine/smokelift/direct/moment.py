"""One moment of moving smoke, and how it is read from a sequence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smokelift.direct.constraint import FaceMasks, project_with_given_faces
from smokelift.output.sequence import Sequence
from smokelift.transport import Array, Velocity, divergence, on_faces

DIVERGENCE_TOLERANCE = 1e-3
"""Divergence times voxel size over the largest speed, below which a velocity counts as free of divergence."""

COMPLETION_ITERATIONS = 30
"""Iterations in which a velocity that is known near smoke alone is completed."""


@dataclass(frozen=True, eq=False)
class Moment:
    """One moment of moving smoke.

    Attributes
    ----------
    density : (nx, ny, nz) float32
        At voxel centres.
    velocity
        Without divergence, in m/s; it has carried the moment before to this one.
    flame : (nx, ny, nz) float32, optional
        Emission of fire; None without any.
    """

    density: Array
    velocity: Velocity
    flame: Array | None = None


def read_moment(sequence: Sequence, number: int) -> Moment:
    """Read a frame of a sequence."""
    velocity = sequence.velocity(number)
    return Moment(sequence.density(number), complete_velocity(velocity), sequence.flame(number))


def complete_velocity(velocity: Velocity) -> Velocity:
    """The velocity without divergence that is nearest to one that is known near smoke alone, and zero elsewhere.

    Files keep the velocity near smoke. Cut off there it has divergence, and projecting that would slow the smoke down;
    so the air around is set in motion instead. A velocity without divergence stays as it is.
    """
    largest = max(float(np.abs(component).max()) for component in velocity.faces)
    if float(np.abs(divergence(velocity)).max()) * velocity.voxel_size <= DIVERGENCE_TOLERANCE * largest:
        return velocity
    found = project_with_given_faces(velocity, _known(velocity), velocity.faces, limit=COMPLETION_ITERATIONS)
    return velocity.with_faces(found.faces)


def _known(velocity: Velocity) -> FaceMasks:
    """The faces both of whose voxels have a velocity."""
    known = velocity.centres().any(axis=-1, keepdims=True).astype(np.float32)
    x, y, z = (both == 1 for both in on_faces(np.broadcast_to(known, (*velocity.shape, 3))))
    return x, y, z
