"""What an artist places around the smoke: wind, fans and obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from smokelift.direct.constraint import FaceMasks, Mask, faces_between, faces_of, without_divergence_given
from smokelift.scene import Domain
from smokelift.scene.checks import Vector
from smokelift.transport import Velocity, project

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
    blown
        The faces of every fan's voxels, with its velocity in m/s.
    solid : (nx, ny, nz) bool
        Voxels of obstacles, through which nothing passes; None without any.
    """

    wind: Vector = (0.0, 0.0, 0.0)
    blown: tuple[tuple[FaceMasks, Vector], ...] = ()
    solid: Mask | None = None

    def gain(self, step: int, dt: float) -> Vector:
        """The velocity that the wind adds in a step, counted from 1."""
        share = math.exp(-(step - 1) * dt / RISE) - math.exp(-step * dt / RISE)
        x, y, z = (share * component for component in self.wind)
        return x, y, z

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
