"""What an artist places around the smoke: wind, turbulence, fans and obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from smokelift.direct.constraint import FaceMasks, Mask, faces_between, faces_of, without_divergence_given
from smokelift.direct.turbulence import Turbulence
from smokelift.scene import Domain
from smokelift.scene.checks import Vector
from smokelift.transport import Array, Velocity, project

RISE = 0.5
"""Seconds in which the air takes on most (1 - 1/e) of a wind that sets in: a gust, and not a blow."""


@dataclass(frozen=True)
class Ball:
    """A round obstacle or, moving, a fan.

    Attributes
    ----------
    centre
        In metres.
    radius
        In metres, above 0.
    """

    centre: Vector
    radius: float

    def voxels(self, domain: Domain) -> Mask:
        """The voxels whose centres lie in it, shape (nx, ny, nz)."""
        x, y, z = domain.offsets(self.centre)
        inside: Mask = x**2 + y**2 + z**2 <= self.radius**2
        return inside


@dataclass(frozen=True)
class Box:
    """A box as obstacle.

    Attributes
    ----------
    low, high
        Corners in metres.
    """

    low: Vector
    high: Vector

    def voxels(self, domain: Domain) -> Mask:
        """The voxels whose centres lie in it, shape (nx, ny, nz)."""
        above, below = domain.offsets(self.low), domain.offsets(self.high)
        x, y, z = ((a >= 0) & (b <= 0) for a, b in zip(above, below, strict=True))
        inside: Mask = x & y & z
        return inside


@dataclass(frozen=True)
class Fan:
    """Air that is blown, in a ball.

    Attributes
    ----------
    place
        The ball.
    velocity
        Of the air in it, in m/s.
    """

    place: Ball
    velocity: Vector


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What acts on the smoke from outside.

    Attributes
    ----------
    wind
        Velocity in m/s that all air gains, beside what moves it already.
    turbulences
        Eddies that all air gains, likewise.
    blown
        The faces of every fan's voxels, with its velocity in m/s.
    solid : (nx, ny, nz) bool
        Voxels of obstacles, through which nothing passes; None without any.
    """

    wind: Vector = (0.0, 0.0, 0.0)
    turbulences: tuple[Turbulence, ...] = ()
    blown: tuple[tuple[FaceMasks, Vector], ...] = ()
    solid: Mask | None = None

    def air(self, like: Velocity, time: float) -> list[Array]:
        """The velocity in m/s that wind and turbulence have given to all air after a time in seconds, on faces."""
        share = np.float32(1 - math.exp(-time / RISE))
        faces = [np.full_like(component, speed) for component, speed in zip(like.faces, self.wind, strict=True)]
        for turbulence in self.turbulences:
            eddies = turbulence.velocity(like, time)
            faces = [component + eddy for component, eddy in zip(faces, eddies, strict=True)]
        return [share * component for component in faces]

    def projected(self, velocity: Velocity) -> Velocity:
        """The nearest velocity without divergence that goes through no obstacle, and is zero inside."""
        if self.solid is None:
            return project(velocity)
        outer = faces_between(self.solid)
        still = tuple(np.zeros_like(component) for component in velocity.faces)
        field = without_divergence_given(velocity, outer, (still[0], still[1], still[2]))
        inside = faces_of(self.solid)
        return velocity.with_faces(
            np.where(mask, np.float32(0), component) for mask, component in zip(inside, field.faces, strict=True)
        )
