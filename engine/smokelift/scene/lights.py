"""What lights the smoke."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from smokelift.scene.checks import (
    SceneError,
    Vector,
    colour,
    file_path,
    integer,
    number,
    set_fields,
    unexpected,
    vector,
)


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light; ``direction`` is the direction of travel, ``irradiance`` in W/m^2 per channel."""

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


@dataclass(frozen=True)
class PointLight:
    """Light from a point; ``intensity`` in W/sr per channel."""

    position: Vector
    intensity: Vector

    def __post_init__(self) -> None:
        """Check the values."""
        set_fields(self, position=vector(self.position, "position"), intensity=colour(self.intensity, "intensity"))


@dataclass(frozen=True)
class EnvironmentLight:
    """Light from an equirectangular picture (.exr, .hdr), turned about Z, scaled by ``strength``.

    ``directions`` is the number of parallel lights that stand for it; None takes as many as the smoke needs.
    """

    image: Path
    rotation_degrees: float = 0.0
    strength: float = 1.0
    directions: int | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        image = file_path(self.image, "image")
        if image.suffix.lower() not in (".exr", ".hdr"):
            raise unexpected(str(image), "image", "an .exr or .hdr file")
        strength = number(self.strength, "strength", "a number not below 0", lambda v: v >= 0.0)
        rotation = number(self.rotation_degrees, "rotation_degrees")
        set_fields(self, image=image, rotation_degrees=rotation, strength=strength)
        if self.directions is not None:
            set_fields(self, directions=integer(self.directions, "directions", "a whole number from 1", least=1))


Light = DirectionalLight | PointLight | EnvironmentLight
