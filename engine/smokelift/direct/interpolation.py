"""Smoke between two moments: both are advected to the time between them, and blended there."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from smokelift.direct.moment import Moment
from smokelift.transport import Array, Velocity, advect, project

Carried = TypeVar("Carried", Array, Velocity)
Mix = Callable[[Array, Array, float], Array]

RESOLVED = 1e-6
"""Nearer than this to 0 or 1 the result is one of the two moments itself."""


def interpolate(
    before: Moment, after: Moment, motion: Velocity, dt: float, share: float, mix: Mix | None = None
) -> Moment:
    """The smoke at a share of the time from one moment to another.

    The first moment is advected forwards by its part of the time, the second backwards by the rest, and the two are
    blended by the share. So nothing shows twice where the motion is right, and the mass changes linearly from that of
    the first to that of the second.

    Parameters
    ----------
    motion
        Velocity in m/s that carries the first to the second in `dt` seconds, at the points of arrival.
    share
        0 for the first, 1 for the second.
    mix
        Mixes what of density and of emission is carried from both, by the share; linearly if it is None.
    """
    if share < RESOLVED:
        return before
    if share > 1 - RESOLVED:
        return after
    midway = advect_back(motion, motion, (1 - share) * dt)

    def blended(first: Array, second: Array) -> Array:
        forwards = advect(first, midway, share * dt, conserve=True)
        return (mix or _blend)(forwards, advect_back(second, midway, (1 - share) * dt), share)

    density = blended(before.density, after.density)
    flame = None if before.flame is None or after.flame is None else blended(before.flame, after.flame)
    velocities = (
        advect(before.velocity, midway, share * dt),
        advect_back(after.velocity, midway, (1 - share) * dt),
    )
    x, y, z = (_blend(a, b, share) for a, b in zip(velocities[0].faces, velocities[1].faces, strict=True))
    velocity = project(before.velocity.with_faces((x, y, z)))
    return Moment(density, Velocity(velocity.faces, velocity.voxel_size, velocity.closed), flame)


def advect_back(field: Carried, velocity: Velocity, dt: float) -> Carried:
    """Advect a density or a velocity against a velocity (m/s): to where it was `dt` seconds ago."""
    backwards = velocity.with_faces(-component for component in velocity.faces)
    return advect(field, backwards, dt, conserve=not isinstance(field, Velocity))


def _blend(a: Array, b: Array, share: float) -> Array:
    return (1 - np.float32(share)) * a + np.float32(share) * b
