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

SIGNIFICANT = 3.0
"""Standard errors from 0, beyond which a mean is no accident."""


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


def fit_physics(moments: Sequence[Moment], dt: float, inlets: Mask) -> Physics:
    """Fit buoyancy and dissipation to the moments of a clip.

    From one moment to the next the buoyancy is the one from which the change of velocity follows best:

        min sum |u_n - P(advect(u_n-1)) - dt b P(rho_n-1 up)|^2

    over the faces outside the inlets. The mean over the moments counts if they agree on it; where velocities are known
    too roughly for that, it is 0. The dissipation is what brings the mass outside the inlets from that of the carried
    smoke to that found.
    """
    outside = [~mask for mask in faces_of(inlets)]
    found: list[float] = []
    carried_mass = found_mass = 0.0
    for before, after in pairwise(moments):
        found += _buoyancy(before, after, dt, outside)
        carried = advect(before.density, after.velocity, dt, conserve=True)
        carried_mass += float(carried.sum(dtype=np.float64, where=~inlets))
        found_mass += float(after.density.sum(dtype=np.float64, where=~inlets))
    lost = math.log(carried_mass / found_mass) / dt if carried_mass > 0 and found_mass > 0 else 0.0
    return Physics(_significant_mean(found), max(0.0, lost))


def _buoyancy(before: Moment, after: Moment, dt: float, outside: list[Mask]) -> list[float]:
    """The buoyancy that two moments show; none where there is nothing to lift."""
    predicted = project(advect(before.velocity, before.velocity, dt))
    unit = project(lift(before.density, before.velocity))
    change_along = square = 0.0
    for kept, now, then, lifted in zip(outside, after.velocity.faces, predicted.faces, unit.faces, strict=True):
        change_along += float(np.vdot((now - then)[kept], lifted[kept]))
        square += float(np.vdot(lifted[kept], lifted[kept]))
    return [change_along / (dt * square)] if square > 0 else []


def _significant_mean(found: list[float]) -> float:
    """The mean of what several moments show; 0 where it is within `SIGNIFICANT` standard errors of that."""
    if len(found) < 2:
        return 0.0
    mean, error = float(np.mean(found)), float(np.std(found, ddof=1)) / math.sqrt(len(found))
    return mean if abs(mean) > SIGNIFICANT * error else 0.0
