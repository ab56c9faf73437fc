"""The forces and losses of a clip's smoke, fitted to its last moments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from smokelift.direct.constraint import Mask, faces_of
from smokelift.direct.moment import Moment
from smokelift.transport import Array, Velocity, advect, project


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
    """The force on the smoke, as an acceleration in m/s2, where buoyancy is 1."""
    faces = [np.zeros_like(component) for component in like.faces]
    faces[2][:, :, 1:-1] = 0.5 * (density[:, :, 1:] + density[:, :, :-1])
    return like.with_faces(faces)


def fit_physics(moments: Sequence[Moment], dt: float, inlets: Mask) -> Physics:
    """Fit buoyancy and dissipation to the moments of a clip.

    The buoyancy is the one from which the change of velocity follows best:

        min sum |u_n - P(advect(u_n-1)) - dt b P(rho_n-1 up)|^2

    over the faces outside the inlets. The dissipation is what brings the mass outside the inlets from that of the
    carried smoke to that found.
    """
    outside = [~mask for mask in faces_of(inlets)]
    along = square = carried_mass = found_mass = 0.0
    for before, after in pairwise(moments):
        predicted = project(advect(before.velocity, before.velocity, dt))
        unit = project(lift(before.density, before.velocity))
        for kept, now, then, pushed in zip(outside, after.velocity.faces, predicted.faces, unit.faces, strict=True):
            along += float(np.vdot((now - then)[kept], pushed[kept]))
            square += float(np.vdot(pushed[kept], pushed[kept]))
        carried = advect(before.density, after.velocity, dt, conserve=True)
        carried_mass += float(carried.sum(dtype=np.float64, where=~inlets))
        found_mass += float(after.density.sum(dtype=np.float64, where=~inlets))
    buoyancy = along / (dt * square) if square > 0 else 0.0
    lost = math.log(carried_mass / found_mass) / dt if carried_mass > 0 and found_mass > 0 else 0.0
    return Physics(buoyancy, max(0.0, lost))
