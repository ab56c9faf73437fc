"""Light, and what smoke does to it. A new kind of light has a class here and an entry in `LIGHT_TYPES`."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

from smokelift.checks import shown
from smokelift.scene.checks import (
    SceneError,
    Vector,
    check_given,
    color,
    file_path,
    integer,
    number,
    positive,
    set_fields,
    unexpected,
    vector,
)
from smokelift.scene.domain import Box, Domain

MAX_DISTANCE_VOXELS = 1e6
"""Voxels between a point light and the box, at most: its rays are parallel long before."""

MAX_DIRECTIONS = 4096
"""Parallel lights that stand for one environment, at most: every picture sweeps the voxels once for each."""

Scattering = Literal["multiple", "single", "unshadowed", "absorption"]
"""How light is scattered: any number of times, once and with self-shadowing, once without, or not at all."""

SCATTERINGS: tuple[Scattering, ...] = ("multiple", "single", "unshadowed", "absorption")

SHADOWED: tuple[Scattering, ...] = ("multiple", "single")
"""Models of scattering in which smoke casts shadows on itself."""


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
        set_fields(self, direction=direction, irradiance=color(self.irradiance, "irradiance"))

    def samples(self) -> "tuple[FiniteLight, ...]":
        """Return the light itself; see `SampledLight`."""
        return (self,)


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
        set_fields(self, position=vector(self.position, "position"), intensity=color(self.intensity, "intensity"))

    def samples(self) -> "tuple[FiniteLight, ...]":
        """Return the light itself; see `SampledLight`."""
        return (self,)

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


@dataclass(frozen=True)
class EnvironmentLight:
    """Light from all around, as an equirectangular picture gives it.

    Attributes
    ----------
    image
        The picture, .exr or .hdr.
    rotation_degrees
        By which it is turned about Z.
    strength
        Factor of its radiance.
    directions
        Parallel lights that approximate it; None takes as many as the smoke needs.
    """

    image: Path
    rotation_degrees: float = 0.0
    strength: float = 1.0
    directions: int | None = None

    def __post_init__(self) -> None:
        image = file_path(self.image, "image")
        if image.suffix.lower() not in (".exr", ".hdr"):
            raise unexpected(str(image), "image", "an .exr or .hdr file")
        strength = number(self.strength, "strength", "a number not below 0", lambda v: v >= 0.0)
        rotation = number(self.rotation_degrees, "rotation_degrees")
        set_fields(self, image=image, rotation_degrees=rotation, strength=strength)
        if self.directions is not None:
            expected = f"a whole number from 1 to {MAX_DIRECTIONS}"
            set_fields(self, directions=integer(self.directions, "directions", expected, 1, MAX_DIRECTIONS))


Light = SampledLight | EnvironmentLight
"""An environment is no `SampledLight`: how many lights it needs depends on the camera and the medium."""

LIGHT_TYPES: dict[str, type[Any]] = {
    "directional": DirectionalLight,
    "point": PointLight,
    "environment": EnvironmentLight,
}
"""The frozen dataclass of each ``type`` that [[lights]] may have; its fields are the keys of the table."""


@dataclass(frozen=True)
class Medium:
    """Optical properties of the smoke.

    Attributes
    ----------
    extinction
        Extinction cross-section, 1/m per unit density.
    albedo
        Single-scattering albedo, 0 to 1.
    anisotropy
        Henyey-Greenstein g, -1 < g < 1.
    color
        Color of the smoke itself, red, green and blue from 0 to 1. Each channel's albedo is ``albedo`` times this.
        Extinction is the same for all.
    flame_color
        Color of the light of fire in the smoke, red, green and blue from 0 to 1. Times the emission in the grid
        ``flame`` it is the radiance per meter. What may be fire is fire then. None takes what the clip shows.
    """

    extinction: float = 5.0
    albedo: float = 0.9
    anisotropy: float = 0.0
    color: Vector = (1.0, 1.0, 1.0)
    flame_color: Vector | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            extinction=positive(self.extinction, "extinction"),
            albedo=number(self.albedo, "albedo", "a number from 0 to 1", lambda v: 0.0 <= v <= 1.0),
            anisotropy=number(self.anisotropy, "anisotropy", "a number between -1 and 1", lambda v: -1.0 < v < 1.0),
            color=_fractions(self.color, "color"),
        )
        check_given(self, flame_color=_fractions)

    @property
    def albedos(self) -> Vector:
        """Single-scattering albedo of red, green and blue."""
        red, green, blue = self.color
        return self.albedo * red, self.albedo * green, self.albedo * blue

    @property
    def is_gray(self) -> bool:
        """Whether the smoke scatters red, green and blue alike."""
        return min(self.color) == max(self.color)


def _fractions(value: Any, key: str) -> Vector:
    """Return ``value`` as fractions of red, green and blue, or raise a SceneError that names ``key``."""
    expected = "three numbers [r, g, b] from 0 to 1, one of them above 0"
    rgb = vector(value, key, expected)
    if min(rgb) < 0.0 or max(rgb) > 1.0 or max(rgb) == 0.0:
        raise unexpected(list(rgb), key, expected)
    return rgb
