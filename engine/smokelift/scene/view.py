"""What a camera filmed and what it sees behind the smoke; further cameras of a scene."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from smokelift.checks import require_kind
from smokelift.scene.camera import Camera
from smokelift.scene.checks import (
    SceneError,
    Vector,
    check_given,
    color,
    file_path,
    integer,
    items,
    positive,
    set_fields,
    unexpected,
)


@dataclass(frozen=True)
class ClipSource:
    """Where a clip lies and how to read it.

    Attributes
    ----------
    path
        A video, or an image sequence written ``frame_####.png``.
    fps
        Frames per second of the captured motion; None takes it from the file.
    frames
        First and last frame, both included, counted from 0; None takes all.
    transfer
        ``"srgb"`` or ``"linear"``; None takes what the file says, else srgb for 8 to 16 bit integers and linear for
        EXR.
    mask
        A garbage matte: white where smoke may be, black where none is, whatever moves there. A picture; or a video, or
        pictures written ``mask_####.png``, whose frame n belongs to the clip's frame n.
    """

    path: Path
    fps: float | None = None
    frames: tuple[int, int] | None = None
    transfer: Literal["srgb", "linear"] | None = None
    mask: Path | None = None

    def __post_init__(self) -> None:
        set_fields(self, path=file_path(self.path, "path"))
        check_given(self, fps=positive, mask=file_path)
        if self.frames is not None:
            expected = "[first, last], whole numbers from 0, first not after last"
            first, last = (integer(v, "frames", expected) for v in items(self.frames, 2, "frames", expected))
            if not 0 <= first <= last:
                raise unexpected([first, last], "frames", expected)
            set_fields(self, frames=(first, last))
        if self.transfer not in (None, "srgb", "linear"):
            raise unexpected(self.transfer, "transfer", '"srgb" or "linear"')

    @property
    def first(self) -> int:
        """First frame, counted from 0."""
        return 0 if self.frames is None else self.frames[0]


@dataclass(frozen=True)
class Background:
    """What the camera sees behind the smoke: one color, a clean plate or frames of the clip; else it is estimated.

    Attributes
    ----------
    color
        One linear color.
    image
        A clean plate: a picture. A video, or pictures written ``plate_####.png``, is a plate that changes: its frame n
        is behind the clip's frame n.
    frame
        Frames of the clip's file that are free of smoke, counted from 0: one number or a list.
    strokes
        A picture of the clip's size with alpha, painted green where smoke is, red where none is, and blue where the
        clean plate has the pixel's own value. It may stand with any of the others, or alone.
    """

    color: Vector | None = None
    image: Path | None = None
    frame: tuple[int, ...] | None = None
    strokes: Path | None = None

    def __post_init__(self) -> None:
        given = [key for key in ("color", "image", "frame") if getattr(self, key) is not None]
        if len(given) > 1:
            raise SceneError(f"takes {given[0]} or {given[1]}, not both", key=given[1])
        check_given(self, color=color, image=file_path, frame=_frames, strokes=file_path)

    @property
    def estimated(self) -> bool:
        """Whether the picture behind the smoke is estimated, since the scene does not give it."""
        return self.color is None and self.image is None and self.frame is None


def _frames(value: Any, key: str) -> tuple[int, ...]:
    """Return one number of a frame or a list of them as a tuple, or raise a SceneError that names ``key``."""
    expected = "the number of a frame, counted from 0, or a list of such numbers"
    listed = value if isinstance(value, list | tuple) else [value]
    if not listed:
        raise unexpected(value, key, expected)
    return tuple(integer(number, key, expected, least=0) for number in listed)


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
        What it sees behind the smoke; None takes the scene's if that is one color, and estimates it otherwise.
    """

    camera: Camera
    clip: ClipSource
    background: Background | None = None

    def __post_init__(self) -> None:
        require_kind(self.camera, Camera, "camera", "a Camera")
        require_kind(self.clip, ClipSource, "clip", 'a ClipSource, such as ClipSource("clip.mp4")')
        require_kind(self.background, Background | None, "background", "a Background")
