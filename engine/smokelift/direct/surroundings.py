"""What an artist places around the smoke: wind, turbulence, fans and obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from smokelift.direct.constraint import FaceMasks
from smokelift.direct.obstacles import Ball, Obstacles, Solid
from smokelift.direct.turbulence import Turbulence
from smokelift.scene.checks import Vector
from smokelift.transport import Array, Velocity

RISE = 0.5
"""Seconds in which the air takes on most (1 - 1/e) of a wind that sets in: a gust, and not a blow."""


@dataclass(frozen=True)
class Fan:
    """Air that is blown, in a ball, at a velocity in m/s."""

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
    obstacles
        Through which nothing passes; None without any.
    first
        Voxel at which the box begins, counted from the clip's box: turbulence stays where it is when the box grows.
    """

    wind: Vector = (0.0, 0.0, 0.0)
    turbulences: tuple[Turbulence, ...] = ()
    blown: tuple[tuple[FaceMasks, Vector], ...] = ()
    obstacles: Obstacles | None = None
    first: tuple[int, ...] = (0, 0, 0)

    def air(self, like: Velocity, time: float) -> list[Array]:
        """The velocity in m/s that wind and turbulence have given to all air after a time in seconds, on faces."""
        share = np.float32(1 - math.exp(-time / RISE))
        faces = [np.full_like(component, speed) for component, speed in zip(like.faces, self.wind, strict=True)]
        for turbulence in self.turbulences:
            eddies = turbulence.velocity(like, time, self.first)
            faces = [component + eddy for component, eddy in zip(faces, eddies, strict=True)]
        return [share * component for component in faces]

    def solid(self, step: int, dt: float) -> Solid | None:
        """What is solid after so many steps; None if nothing is."""
        return self.obstacles.at(step, dt) if self.obstacles is not None else None
