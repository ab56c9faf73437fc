"""A further camera and what it filmed."""

from __future__ import annotations

from dataclasses import dataclass

from smokelift.checks import require_kind
from smokelift.scene.background import Background
from smokelift.scene.camera import Camera
from smokelift.scene.clip_source import ClipSource


@dataclass(frozen=True)
class View:
    """A further calibrated camera with its own clip.

    Attributes
    ----------
    camera
        Where it stands, and its lens. It does not move.
    clip
        Its ``frames`` show the same moments as those of the scene's clip; None takes the same numbers.
    background
        What it sees behind the smoke; None takes the scene's if that is one colour, and estimates it otherwise.
    """

    camera: Camera
    clip: ClipSource
    background: Background | None = None

    def __post_init__(self) -> None:
        """Check the kinds."""
        require_kind(self.camera, Camera, "camera", "a Camera")
        require_kind(self.clip, ClipSource, "clip", 'a ClipSource, such as ClipSource("clip.mp4")')
        require_kind(self.background, Background | None, "background", "a Background")
