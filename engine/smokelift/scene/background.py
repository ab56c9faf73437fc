"""What is behind the smoke."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from smokelift.scene.checks import SceneError, Vector, colour, file_path, set_fields


@dataclass(frozen=True)
class Background:
    """What the camera sees behind the smoke: one colour or a clean plate; with neither it is estimated from the clip.

    Attributes
    ----------
    color
        One linear colour.
    image
        A clean plate: a picture. A video, or pictures written ``plate_####.png``, is a plate that changes: its frame n
        is behind the clip's frame n.
    """

    color: Vector | None = None
    image: Path | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        if self.color is not None and self.image is not None:
            raise SceneError("takes color or image, not both", key="image")
        if self.color is not None:
            set_fields(self, color=colour(self.color, "color"))
        if self.image is not None:
            set_fields(self, image=file_path(self.image, "image"))
