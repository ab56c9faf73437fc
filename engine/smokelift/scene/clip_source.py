"""Where a clip lies and how to read it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from smokelift.scene.checks import file_path, integer, items, positive, set_fields, unexpected


@dataclass(frozen=True)
class ClipSource:
    """Where a clip lies and how to read it.

    Attributes
    ----------
    path
        A video, or an image sequence written ``frame_####.png``.
    fps
        Frames a second of the captured motion; None takes it from the file.
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
        """Check the values."""
        set_fields(self, path=file_path(self.path, "path"))
        if self.fps is not None:
            set_fields(self, fps=positive(self.fps, "fps"))
        if self.frames is not None:
            expected = "[first, last], whole numbers from 0, first not after last"
            first, last = (integer(v, "frames", expected) for v in items(self.frames, 2, "frames", expected))
            if not 0 <= first <= last:
                raise unexpected([first, last], "frames", expected)
            set_fields(self, frames=(first, last))
        if self.transfer not in (None, "srgb", "linear"):
            raise unexpected(self.transfer, "transfer", '"srgb" or "linear"')
        if self.mask is not None:
            set_fields(self, mask=file_path(self.mask, "mask"))

    @property
    def first(self) -> int:
        """First frame, counted from 0."""
        return 0 if self.frames is None else self.frames[0]
