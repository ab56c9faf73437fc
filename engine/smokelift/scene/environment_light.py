"""Light from all around, as a picture gives it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from smokelift.scene.checks import file_path, integer, number, set_fields, unexpected

MAX_DIRECTIONS = 4096
"""Parallel lights that stand for one environment, at most: every picture sweeps the voxels once for each."""


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
        """Check the values."""
        image = file_path(self.image, "image")
        if image.suffix.lower() not in (".exr", ".hdr"):
            raise unexpected(str(image), "image", "an .exr or .hdr file")
        strength = number(self.strength, "strength", "a number not below 0", lambda v: v >= 0.0)
        rotation = number(self.rotation_degrees, "rotation_degrees")
        set_fields(self, image=image, rotation_degrees=rotation, strength=strength)
        if self.directions is not None:
            expected = f"a whole number from 1 to {MAX_DIRECTIONS}"
            set_fields(self, directions=integer(self.directions, "directions", expected, 1, MAX_DIRECTIONS))

    def scaled(self, factor: float) -> EnvironmentLight:
        """Return the light ``factor`` times as strong."""
        return replace(self, strength=factor * self.strength)
