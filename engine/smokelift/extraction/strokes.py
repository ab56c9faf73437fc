"""Strokes painted over one frame: where smoke is, where none ever is, and where the background shows as it is.

They add to what the clip shows, wherever the background came from. A given plate is unknown where smoke is painted; of
one that frames show clear at times, only what never changes is (`clear_picture`). What is unknown is continued from
around it. What is not smoke, and what is behind it, is known: the clip's own median over time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import ndimage

from smokelift.checks import Mask
from smokelift.extraction.plate import Plate, shown_behind
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError
from smokelift.footage.images import area_average, linear_to_srgb, read_layer, srgb_to_linear
from smokelift.footage.inpainting import continuation_errors, push_pull
from smokelift.footage.mask import require_shape

PAINTED = 0.5
"""Alpha, difference of a stroke's channels, and fraction of a pixel's area, from which on a pixel is painted: nearer to
a pure color than to none."""

MEDIAN_FRAMES = 15
"""Number of frames whose median is the background: what smoke passes in fewer than half of them."""


@dataclass(frozen=True, eq=False)
class Strokes:
    """Where a picture is painted green (``smoke``), red (``other``) and blue (``behind``), (rows, columns) each."""

    smoke: Mask
    other: Mask
    behind: Mask

    @staticmethod
    def read(path: Path, size: tuple[int, int]) -> Strokes:
        """Read strokes over a picture of a size (width, height).

        ImageError is raised if the file cannot be read, ClipError if it has another shape, or no stroke.
        """
        values, alpha = read_layer(path, "linear")
        require_shape(f"{path}: these strokes are", values, size, "paint them")
        opaque = np.ones(values.shape[:2], np.bool_) if alpha is None else alpha >= PAINTED
        if not opaque.any():
            raise ClipError(f"{path}: nothing is painted there; paint strokes, or leave them out.")
        painted = opaque & (np.ptp(values, axis=-1) >= PAINTED)
        if not painted.any():
            raise ClipError(f"{path}: no stroke is green (smoke), red (not smoke) or blue (behind); use pure colors.")
        nearest = values.argmax(-1)
        red, green, blue = (area_average(painted & (nearest == n), *size) >= PAINTED for n in range(3))
        return Strokes(green, red, blue)


def stroked(strokes: Strokes, plate: Plate, clip: Clip, one_color: bool) -> tuple[Plate, Clip]:
    """Return a plate with what strokes say of it, and a clip at its exposure that shows it in place of other things.

    Behind smoke before ``one_color`` is that color for certain. ClipError is raised if a frame cannot be read, or if
    nothing is left that is not smoke.
    """
    image, confidence, seen = plate.image.copy(), plate.confidence.copy(), strokes.other | strokes.behind
    if seen.any():
        shown = [clip.frame(number)[seen] for number in clip.spread(MEDIAN_FRAMES)]
        image[seen], confidence[seen] = np.median(shown, axis=0), 1
    if one_color:
        image[strokes.smoke] = np.median(plate.image, axis=(0, 1))
    else:
        confidence[strokes.smoke] = 0
    if not confidence.any():
        raise ClipError("The strokes leave nothing that is not smoke; leave free, or paint blue, what is behind it.")
    # a stroke says nothing of what is unknown elsewhere, which may have detail of its own
    patches, _ = ndimage.label((confidence == 0) | seen, structure=np.ones((3, 3)))
    unknown = (confidence == 0) & np.isin(patches, patches[strokes.smoke | seen])
    image[unknown] = srgb_to_linear(push_pull(linear_to_srgb(image), confidence))[unknown]
    errors = plate.errors if plate.errors.any() else continuation_errors(image, confidence > 0)
    plate, other = replace(plate, image=image, confidence=confidence, errors=errors), strokes.other[..., None]
    if other.any():
        clip = shown_behind(clip, plate, lambda _, picture: np.where(other, np.float32(np.nan), picture))
    return plate, clip
