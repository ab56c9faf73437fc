"""What a clip format implements, and what formats share; `Clip` counts, caches and checks the frames of all of them.

The alpha channel of pictures of smoke alone is the matte, whatever stands behind the smoke. They are shown before one
colour that is known for certain: white behind dark smoke, black behind bright smoke. What is behind a pixel then is 1 -
alpha of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

import numpy as np

from smokelift.checks import Remark
from smokelift.footage.images import Picture, linear_to_srgb
from smokelift.footage.stored_picture import StoredPicture

DEFAULT_FPS = 24.0
"""Frames a second where neither the file nor the user gives any: the rate of film."""

BELIEVED = (4.0, 2000.0)
"""Focal lengths in millimetres on 35 mm film that are; others, 0 above all, say that it is unknown."""

MIDDLE = 0.5
"""sRGB value of smoke that is as far from black as from white."""

OPAQUE = 0.999
"""Alpha from which on nothing is behind a pixel."""

Layer = tuple[Picture, Picture | None]
"""A linear picture (rows, columns, 3) as it is before black, and its alpha (rows, columns), None of an opaque one."""


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
        Focal length in millimetres on 35 mm film (of its diagonal, as CIPA DCG-001 defines it), if the file says it.
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

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        """Return which frames from one to another, both included, raise `DamagedFrameError`."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


class Wrapped:
    """The frames of another source, of which a subclass changes some."""

    def __init__(self, source: FrameSource) -> None:
        self.source = source
        self.count, self.fps, self.warning = source.count, source.fps, source.warning
        self.files, self.lens, self.backdrop = source.files, source.lens, source.backdrop

    @property
    def notes(self) -> tuple[Remark, ...]:
        return self.source.notes

    def read(self, n: int) -> StoredPicture:
        return self.source.read(n)

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        return self.source.damaged(first, last)

    def close(self) -> None:
        self.source.close()


def believed_focal_length(value: object) -> float | None:
    """Return a focal length in millimetres as a file says it; None where it says none."""
    try:
        focal = float(str(value))
    except ValueError:
        return None
    return focal if BELIEVED[0] <= focal <= BELIEVED[1] else None


def shown_before(layer: Layer, backdrop: float | None) -> Picture:
    """Return a picture before a linear grey; before black if there is none."""
    picture, alpha = layer
    if alpha is None or not backdrop:
        return picture
    return picture + (np.float32(1.0) - alpha[..., None]) * np.float32(backdrop)


def backdrop_of(layers: Iterable[Layer]) -> float | None:
    """Return the linear grey that pictures of a clip are shown before; None if they are opaque."""
    light, opacity, opaque = 0.0, 0.0, True
    for picture, alpha in layers:
        if alpha is not None:
            light += float(picture.mean(-1).sum(dtype=np.float64))
            opacity += float(alpha.sum(dtype=np.float64))
            opaque = opaque and bool((alpha >= OPAQUE).all())
    if opaque:
        return None
    return 1.0 if opacity > 0 and linear_to_srgb(light / opacity) < MIDDLE else 0.0


def sample_numbers(count: int) -> list[int]:
    """Return the frames of so many that show whether a clip has a matte: with smoke, and without."""
    return sorted({0, count // 4, count // 2, count - 1})
