"""The focal length that a file gives, as on 35 mm film: of the frame's diagonal, as CIPA DCG-001 defines it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from PIL import Image

FILM_WIDTH = 36.0
FILM_DIAGONAL = math.hypot(FILM_WIDTH, 24)
"""Millimetres of 35 mm film."""

BELIEVED = (4.0, 2000.0)
"""Focal lengths in millimetres that are; others, 0 above all, say that it is unknown."""

_QUICKTIME = "com.apple.quicktime.camera.focal_length.35mm_equivalent"
_EXIF, _FOCAL_LENGTH_IN_35MM_FILM = 0x8769, 0xA405


def of_tags(tags: Mapping[str, str]) -> float | None:
    """Return the focal length in QuickTime's tags, in millimetres; None if there is none."""
    return _believed(tags.get(_QUICKTIME))


def of_picture(path: Path) -> float | None:
    """Return the focal length in the EXIF of a picture, in millimetres; None if there is none."""
    try:
        with Image.open(path) as picture:
            return _believed(picture.getexif().get_ifd(_EXIF).get(_FOCAL_LENGTH_IN_35MM_FILM))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # no picture that has such tags
        return None


def _believed(value: object) -> float | None:
    try:
        focal = float(str(value))
    except ValueError:
        return None
    return focal if BELIEVED[0] <= focal <= BELIEVED[1] else None
