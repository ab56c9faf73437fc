"""The lights that a renderer takes as they are: parallel light, and light from a point."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from smokelift.checks import shown
from smokelift.scene.checks import SceneError, Vector, colour, set_fields, vector
from smokelift.scene.domain import Box, Domain

MAX_DISTANCE_VOXELS = 1e6
"""Voxels between a point light and the box, at most: its rays are parallel long before."""


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light, as the sun's.

    Attributes
    ----------
    direction
        Of travel: from the light towards the smoke. Its length does not count.
    irradiance
        Red, green and blue in W/m^2 on a surface across it.
    """

    direction: Vector
    irradiance: Vector

    def __post_init__(self) -> None:
        """Check the values and make the direction a unit vector."""
        direction = vector(self.direction, "direction")
        length = math.hypot(*direction)
        if length == 0.0:
            raise SceneError("direction must not be [0, 0, 0]", key="direction")
        # What is a unit vector already stays as it is: a saved scene must come back the same.
        if abs(length - 1.0) > 1e-12:
            x, y, z = direction
            direction = (x / length, y / length, z / length)
        set_fields(self, direction=direction, irradiance=colour(self.irradiance, "irradiance"))

    def samples(self) -> tuple[FiniteLight, ...]:
        """Return the light itself; see `SampledLight`."""
        return (self,)

    def scaled(self, factor: float) -> DirectionalLight:
        """Return the light ``factor`` times as strong."""
        red, green, blue = self.irradiance
        return replace(self, irradiance=(factor * red, factor * green, factor * blue))


@dataclass(frozen=True)
class PointLight:
    """Light from a point.

    Attributes
    ----------
    position
        In meters, outside the box.
    intensity
        Red, green and blue in W/sr.
    """

    position: Vector
    intensity: Vector

    def __post_init__(self) -> None:
        """Check the values."""
        set_fields(self, position=vector(self.position, "position"), intensity=colour(self.intensity, "intensity"))

    def samples(self) -> tuple[FiniteLight, ...]:
        """Return the light itself; see `SampledLight`."""
        return (self,)

    def scaled(self, factor: float) -> PointLight:
        """Return the light ``factor`` times as strong."""
        red, green, blue = self.intensity
        return replace(self, intensity=(factor * red, factor * green, factor * blue))

    def require_place(self, domain: Box) -> None:
        """Refuse a place from which no light can be swept through a box: inside it, or too far away."""
        at = f"position {shown(list(self.position))} is"
        if domain.contains(self.position):
            raise SceneError(f"{at} inside the domain; it must be outside", key="position")
        if (
            isinstance(domain, Domain)
            and math.dist(self.position, domain.centre) > MAX_DISTANCE_VOXELS * domain.voxel_size
        ):
            raise SceneError(f"{at} more than a million voxels away; give a directional light instead", key="position")


FiniteLight = DirectionalLight | PointLight
"""What one sweep through the voxels can do."""


@runtime_checkable
class SampledLight(Protocol):
    """A light for which finitely many simple ones stand, whatever the camera and the smoke."""

    def samples(self) -> tuple[FiniteLight, ...]:
        """Return the simple lights."""
        ...

    def scaled(self, factor: float) -> SampledLight:
        """Return the light ``factor`` times as strong."""
        ...
