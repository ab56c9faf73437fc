"""The forces and losses of smoke."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smokelift.transport import Array, Velocity


@dataclass(frozen=True)
class Physics:
    """What acts on the smoke of a clip.

    Attributes
    ----------
    buoyancy
        Upward acceleration at density 1, in m/s2. Below zero for smoke that sinks.
    dissipation
        Rate at which smoke dissolves, in 1/s, at least 0.
    """

    buoyancy: float
    dissipation: float


def lift(density: Array, like: Velocity) -> Velocity:
    """The acceleration in m/s2, on faces, that a buoyancy of 1 gives to a density (nx, ny, nz)."""
    faces = [np.zeros_like(component) for component in like.faces]
    faces[2][:, :, 1:-1] = 0.5 * (density[:, :, 1:] + density[:, :, :-1])
    return like.with_faces(faces)
