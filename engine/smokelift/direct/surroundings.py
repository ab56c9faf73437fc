"""What an artist places around the smoke: wind, turbulence, fans and obstacles, and what of it is solid at a step.

Turbulence is curl noise (Bridson et al. 2007), of random Fourier modes (Kraichnan 1970) in place of a lattice of noise:
the curl of a wave is a wave that swings across its own direction. A sum of waves is known at any place, on any grid.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from smokelift.checks import Doubles, Mask
from smokelift.direct.mesh import Mesh
from smokelift.scene import Box, Domain
from smokelift.scene.checks import Vector
from smokelift.transport import Array, Faces, Velocity, divergence, outflow
from smokelift.transport.pressure import FaceMasks, faces_between, faces_of, project_with_given_faces

MODES = 64
"""Waves in the sum: enough that it shows no pattern."""

OCTAVES = 1.0
"""Octaves over which the sizes of the waves are spread, about that asked for. The flow makes smaller eddies by
itself."""

RISE_SECONDS = 0.5
"""Seconds in which the air takes on most (1 - 1/e) of a wind that sets in: a gust, and not a blow."""


@dataclass(frozen=True)
class Turbulence:
    """Eddies everywhere, which change in the time that air takes to cross them."""

    speed: float
    """Of the air in the eddies, in m/s, root mean square."""
    size: float
    """Across an eddy, in meters, above 0."""
    seed: int = 0
    """Another one makes other eddies, from 0."""

    def velocity(self, like: Velocity, time: float, first: tuple[int, ...] = (0, 0, 0)) -> list[Array]:
        """The velocity in m/s on the faces of a grid that begins at a voxel, at a time in seconds."""
        numbers, across, phase, rate = self._modes
        turned = self.speed * np.sqrt(2 / MODES) * np.exp(1j * (phase + rate * time))
        faces = []
        for axis, component in enumerate(like.faces):
            places = (first[d] + np.arange(n) + (0.0 if d == axis else 0.5) for d, n in enumerate(component.shape))
            x, y, z = (
                np.exp(1j * np.outer(along, like.voxel_size * place))
                for along, place in zip(numbers.T, places, strict=True)
            )
            layers = (across[:, axis] * turned)[:, None, None] * x[:, :, None] * y[:, None, :]
            waves = np.tensordot(layers.astype(np.complex64), z.astype(np.complex64), axes=(0, 0))
            faces.append(np.ascontiguousarray(waves.real))
        return faces

    @cached_property
    def _modes(self) -> tuple[Doubles, Doubles, Doubles, Doubles]:
        """Waves across cos(number . x + phase + rate t): numbers (MODES, 3) in 1/m, across (MODES, 3), phase, rate."""
        random = np.random.default_rng(self.seed)
        along, other = (random.standard_normal((MODES, 3)) for _ in range(2))
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        across = np.cross(along, other)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        halves = 2 ** (OCTAVES * (random.random(MODES) - 0.5))  # a wave holds two eddies
        numbers, phase = along * (np.pi / self.size * halves)[:, None], 2 * np.pi * random.random(MODES)
        return numbers, across, phase, self.speed / self.size * random.standard_normal(MODES)


@dataclass(frozen=True)
class Fan:
    """Air that is blown in a ball."""

    centre: Vector
    radius: float
    """Of the ball, in meters."""
    velocity: Vector
    """That of the air, in m/s."""

    def voxels(self, domain: Domain) -> Mask:
        """The voxels whose centers lie in it, shape (nx, ny, nz)."""
        x, y, z = domain.offsets(self.centre)
        return np.asarray(x**2 + y**2 + z**2 <= self.radius**2)

    def bounds(self) -> tuple[Vector, Vector]:
        """The corners in meters of the box around it."""
        (x, y, z), r = self.centre, self.radius
        return (x - r, y - r, z - r), (x + r, y + r, z + r)


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


def require_place(what: str, thing: Fan | Mesh, domain: Domain, reach: Box) -> None:
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
    obstacles: tuple[Mesh, ...] = ()
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
        return [(faces_of(fan.voxels(self.domain)), fan.velocity) for fan in self.fans if self.domain is not None]

    def solid(self, step: int, dt: float) -> Solid | None:
        """What is solid after so many steps of `dt` seconds; None if nothing is, ValueError if it fills the box."""
        if self.domain is None or not self.obstacles:
            return None
        voxels, velocity = self._at_rest, None
        for obstacle in self.obstacles:
            if obstacle.moves:
                inside, speeds = obstacle.solid(self.domain, step, dt)
                others = velocity or tuple(map(np.zeros_like, speeds))
                x, y, z = (np.where(*three) for three in zip(faces_of(inside), speeds, others, strict=True))
                voxels, velocity = voxels | inside, (x, y, z)
        if voxels.all():
            raise ValueError("the obstacles fill the whole box; make them smaller.")
        return Solid(voxels, velocity) if voxels.any() else None

    @cached_property
    def _at_rest(self) -> Mask:
        assert self.domain is not None
        voxels: Mask = np.zeros(self.domain.shape, bool)
        for obstacle in self.obstacles:
            if not obstacle.moves:
                voxels |= obstacle.voxels(self.domain)
        return voxels
