"""Smoke between two moments: both are carried to it, and mixed there."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from smokelift.direct.moment import Moment
from smokelift.transport import Array, Velocity, advect, project

Carried = TypeVar("Carried", Array, Velocity)

RESOLVED = 1e-6
"""Shares nearer than this to 0 or 1 are the moments themselves."""


def between(before: Moment, after: Moment, motion: Velocity, dt: float, share: float) -> Moment:
    """The smoke at a share of the way from one moment to another.

    The first moment is carried forwards by its part of the way, the second back by the rest, and the two are mixed by
    the share. So nothing is seen twice where the motion is right, and the mass goes evenly from the one's to the
    other's.

    Parameters
    ----------
    before, after
        The two moments.
    motion
        Velocity in m/s that carries the first to the second in `dt`, at the points of arrival.
    dt
        Seconds from the one to the other.
    share
        0 for the first, 1 for the second.
    """
    if share < RESOLVED:
        return before
    if share > 1 - RESOLVED:
        return after
    on_the_way = back(motion, motion, (1 - share) * dt)

    def carried(first: Array, second: Array) -> Array:
        forwards = advect(first, on_the_way, share * dt, conserve=True)
        return _mixed(forwards, back(second, on_the_way, (1 - share) * dt), share)

    density = carried(before.density, after.density)
    flame = None if before.flame is None or after.flame is None else carried(before.flame, after.flame)
    velocities = (
        advect(before.velocity, on_the_way, share * dt),
        back(after.velocity, on_the_way, (1 - share) * dt),
    )
    x, y, z = (_mixed(a, b, share) for a, b in zip(velocities[0].faces, velocities[1].faces, strict=True))
    velocity = project(before.velocity.with_faces((x, y, z)))
    return Moment(density, Velocity(velocity.faces, velocity.voxel_size, velocity.closed), flame)


def back(field: Carried, velocity: Velocity, dt: float) -> Carried:
    """Carry a density or a velocity back to where a velocity (m/s) has brought it from, `dt` seconds ago."""
    backwards = velocity.with_faces(-component for component in velocity.faces)
    return advect(field, backwards, dt, conserve=not isinstance(field, Velocity))


def _mixed(a: Array, b: Array, share: float) -> Array:
    return (1 - np.float32(share)) * a + np.float32(share) * b
