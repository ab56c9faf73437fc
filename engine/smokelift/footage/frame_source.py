"""What a clip format implements; `Clip` counts, caches and checks the frames of all of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from smokelift.checks import Remark
from smokelift.footage.stored_picture import StoredPicture

Visitor = Callable[[int, Callable[[], StoredPicture]], None]
"""What is called with the number of a frame and a function that makes its picture."""

DEFAULT_FPS = 24.0
"""Frames a second where neither the file nor the user gives any: the rate of film."""


class ClipError(ValueError):
    """A clip, or a frame of it, that cannot be read."""


class DamagedFrameError(ClipError):
    """A frame that is missing or cannot be decoded; those around it may be sound."""


class FrameSource(Protocol):
    """The frames of one file or sequence, counted from 0 over the whole of it.

    Attributes
    ----------
    count
        Frames that can be read.
    fps
        Frames a second.
    warning
        A remark on a defect, else None.
    files
        The video, or a picture a frame.
    lens
        Focal length in millimetres on 35 mm film, if the file says it.
    backdrop
        Linear grey that is shown behind pictures with an alpha channel; None behind opaque ones.
    """

    count: int
    fps: float
    warning: Remark | None
    files: tuple[Path, ...]
    lens: float | None
    backdrop: float | None

    @property
    def notes(self) -> tuple[Remark, ...]:
        """How the pictures are read where that is not the usual way."""
        ...

    def read(self, n: int) -> StoredPicture:
        """Return a frame; raise `DamagedFrameError` if it cannot be decoded."""
        ...

    def damaged(self, first: int, last: int, visit: Visitor | None = None) -> tuple[int, ...]:
        """Return which frames from one to another, both included, raise `DamagedFrameError`; others go to ``visit``."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...
