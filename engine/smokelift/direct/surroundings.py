"""What an artist places around the smoke: wind, turbulence, fans and obstacles, and what of it is solid at a step."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from smokelift.checks import Mask
from smokelift.direct.mesh import Mesh
from smokelift.direct.turbulence import Turbulence
from smokelift.scene import Box, Domain
from smokelift.scene.checks import Vector
from smokelift.transport import Array, Faces, Velocity, divergence, outflow
from smokelift.transport.pressure import FaceMasks, faces_between, faces_of, project_with_given_faces

RISE_SECONDS = 0.5
"""Seconds in which the air takes on most (1 - 1/e) of a wind that sets in: a gust, and not a blow."""


@dataclass(frozen=True)
class Ball:
    """A round obstacle or, moving, a fan: its center and radius in meters."""

    centre: Vector
    radius: float

    def voxels(self, domain: Domain) -> Mask:
        """The voxels whose centers lie in it, shape (nx, ny, nz)."""
        x, y, z = domain.offsets(self.centre)
        return np.asarray(x**2 + y**2 + z**2 <= self.radius**2)

    def bounds(self) -> tuple[Vector, Vector]:
        """The corners in meters of the box around it."""
        (x, y, z), r = self.centre, self.radius
        return (x - r, y - r, z - r), (x + r, y + r, z + r)


@dataclass(frozen=True)
class BoxObstacle:
    """A box as obstacle, by its corners in meters."""

    low: Vector
    high: Vector

    def voxels(self, domain: Domain) -> Mask:
        """The voxels whose centers lie in it, shape (nx, ny, nz)."""
        above, below = domain.offsets(self.low), domain.offsets(self.high)
        x, y, z = ((a >= 0) & (b <= 0) for a, b in zip(above, below, strict=True))
        return np.asarray(x & y & z)

    def bounds(self) -> tuple[Vector, Vector]:
        """Its corners in meters."""
        return self.low, self.high


Obstacle = Ball | BoxObstacle | Mesh


class Solid(NamedTuple):
    """What is solid at a step."""

    voxels: Mask
    """(nx, ny, nz): which voxels are."""
    velocity: Faces | None
    """That of what they are made of, in m/s on all faces; None where all of it stands still."""

    def projected(self, velocity: Velocity) -> Velocity:
        """The nearest velocity that is without divergence outside, and moves with the solid on its faces and inside.

        Nothing goes through the solid's faces but what it displaces; one that swells displaces air.
        """
        inside = faces_of(self.voxels)
        wanted = velocity.with_faces(self.velocity or (np.float32(0) * component for component in velocity.faces))
        if self.velocity is None:
            field = project_with_given_faces(velocity, faces_between(self.voxels), wanted.faces)
        else:
            swelling = np.where(self.voxels, divergence(wanted) * np.float32(velocity.voxel_size), np.float32(0))
            outwards = outflow(swelling, velocity)
            rest, given = (
                field.with_faces(u - a for u, a in zip(field.faces, outwards.faces, strict=True))
                for field in (velocity, wanted)
            )
            found = project_with_given_faces(rest, faces_between(self.voxels), given.faces)
            field = found.with_faces(u + a for u, a in zip(found.faces, outwards.faces, strict=True))
        return velocity.with_faces(
            np.where(mask, own, component)
            for mask, own, component in zip(inside, wanted.faces, field.faces, strict=True)
        )


def require_place(what: str, thing: Obstacle, domain: Domain, reach: Box) -> None:
    """Refuse a thing of that name that no smoke can meet, or a mesh that is open.

    It has to hold a voxel of the box at the start, or to stand where the box can grow to.
    """
    low, high = thing.bounds()
    within = all(c <= a and b <= d for a, b, c, d in zip(low, high, domain.min, domain.max, strict=True))
    if isinstance(thing, Mesh) and thing.moves:
        here = any(_overlap(Mesh(place).bounds(), domain) for place in thing.places)
    else:
        here = bool(thing.voxels(domain).any())
    if not here and (within or not _overlap(thing.bounds(), reach)):
        raise ValueError(
            f"the {what} holds no voxel of the box from {domain.min} to {domain.max} m, nor of what the box can grow "
            "to; move it in, make it larger, or give the box more room."
        )


def _overlap(bounds: tuple[Vector, Vector], box: Box) -> bool:
    """Whether a thing reaches into a box, as far as its bounds tell."""
    low, high = bounds
    return all(a < d and b > c for a, b, c, d in zip(low, high, box.min, box.max, strict=True))


@dataclass(frozen=True)
class Fan:
    """Air that is blown, in a ball, at a velocity in m/s."""

    place: Ball
    velocity: Vector


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What acts on the smoke from outside."""

    domain: Domain | None = None
    """The box; None where nothing is placed in it."""
    wind: Vector = (0.0, 0.0, 0.0)
    """Velocity in m/s that all air gains, beside what moves it already."""
    turbulences: tuple[Turbulence, ...] = ()
    """Eddies that all air gains, likewise."""
    fans: tuple[Fan, ...] = ()
    """In the box."""
    obstacles: tuple[Obstacle, ...] = ()
    """Through which nothing passes, in the box or outside it."""
    first: tuple[int, ...] = (0, 0, 0)
    """Voxel at which the box begins, counted from the clip's box: turbulence stays where it is when the box grows."""

    def air(self, like: Velocity, time: float) -> list[Array]:
        """The velocity in m/s that wind and turbulence have given to all air after a time in seconds, on faces."""
        gained = np.float32(1 - math.exp(-time / RISE_SECONDS))
        faces = [np.full_like(component, speed) for component, speed in zip(like.faces, self.wind, strict=True)]
        for turbulence in self.turbulences:
            eddies = turbulence.velocity(like, time, self.first)
            faces = [component + eddy for component, eddy in zip(faces, eddies, strict=True)]
        return [gained * component for component in faces]

    @cached_property
    def fan_faces(self) -> list[tuple[FaceMasks, Vector]]:
        """The faces of every fan's voxels, with its velocity in m/s."""
        return [(faces_of(fan.place.voxels(self.domain)), fan.velocity) for fan in self.fans if self.domain is not None]

    def solid(self, step: int, dt: float) -> Solid | None:
        """What is solid after so many steps of `dt` seconds; None if nothing is, ValueError if it fills the box."""
        if self.domain is None or not self.obstacles:
            return None
        voxels, velocity = self._at_rest, None
        for obstacle in self.obstacles:
            if isinstance(obstacle, Mesh) and obstacle.moves:
                inside, speeds = obstacle.solid(self.domain, step, dt)
                others = velocity or tuple(map(np.zeros_like, speeds))
                x, y, z = (np.where(*three) for three in zip(faces_of(inside), speeds, others, strict=True))
                voxels, velocity = voxels | inside, (x, y, z)
        if voxels.all():
            raise ValueError("the obstacles fill the whole box; make them smaller.")
        return Solid(voxels, velocity) if voxels.any() else None

    @cached_property
    def _at_rest(self) -> Mask:
        """The voxels of the obstacles that do not move."""
        assert self.domain is not None
        voxels: Mask = np.zeros(self.domain.shape, bool)
        for obstacle in self.obstacles:
            if not (isinstance(obstacle, Mesh) and obstacle.moves):
                voxels |= obstacle.voxels(self.domain)
        return voxels
