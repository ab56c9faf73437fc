"""What a scene says is behind the smoke: a color, clean plates, frames of its clip, and strokes painted over one.

Strokes say where smoke is, where none ever is, and where the background shows as it is. They add to what the clip
shows, wherever the background came from. A clean plate and a color stay known where smoke is painted. A frame of the
clip that is named as plate may hold smoke, and is unknown there; of a plate that frames show clear at times, only what
never changes is (`clean_plate`). What is unknown is continued from around it. What is not smoke, and what is behind it,
is known: the clip's own median over time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import ndimage

from smokelift.checks import Mask
from smokelift.extraction.plate import Plate, shown_behind
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError, is_pattern, is_video
from smokelift.footage.image_files import read_image, read_layer
from smokelift.footage.images import (
    Picture,
    area_average,
    channel_mean,
    continuation_errors,
    linear_to_srgb,
    push_pull,
    reduced_size,
    srgb_to_linear,
)
from smokelift.footage.mask import require_shape
from smokelift.footage.noise import median_of_seen
from smokelift.scene import Background, Camera, Scene, shared_part

ALIKE, MIN_ALIKE_FRACTION = 8 / 255, 0.9
"""Difference in sRGB values up to which a pixel has a background's color, and smallest fraction of such pixels: the
others are a nozzle, a floor, a logo."""

SIDE, FRAMES = 160, 8
"""Pixels along the longer side, and number, of the frames that a color is continued from: a color has no detail."""

COLOR_SPREAD = 0.08
"""Standard deviation, in sRGB values, of what a given color stands for: a clear sky is off its mean by .2 at most. With
.12 leaves below a sky are taken for it (docs/experiments/background.md)."""

FARTHEST = 0.2
"""Difference, in sRGB values, from which on something else is seen: so far a clear sky is off its mean."""

MIN_BESIDE = 0.02
"""Smallest fraction of the picture that has the color beside a mask where that is to show how the color goes on. A
mask's edge, a pixel wide, of half of the picture is 1.8 %."""

COLOR_WEIGHT = 1e-4
"""Weight of the color itself in each pixel, beside that of a pixel that shows it."""

PAINTED = 0.5
"""Alpha, lead of a stroke's channel over both others, and fraction of a pixel's area, from which on a pixel is painted:
nearer to a pure color than to none."""

MEDIAN_FRAMES = 15
"""Number of frames whose median is the background: what smoke passes in fewer than half of them."""


def open_plates(background: Background | None, camera: Camera | None) -> Clip | None:
    """Open a clean plate as a clip if it changes from frame to frame; else return None.

    Its frames are counted as those of the clip's file. If the camera moves, a numbered picture stands for the sequence
    that it begins, else for itself. ClipError is raised if the plate cannot be read.
    """
    image = None if background is None else background.image
    changes = image is not None and ((camera is not None and camera.moves) or is_pattern(image) or is_video(image))
    return Clip.open(image) if image is not None and changes else None


def read_background(background: Background, camera: Camera | None) -> Picture | Clip | None:
    """Return what a scene says is behind the smoke, but for frames of its clip; None if it says nothing.

    A linear color (3,), a picture (rows, columns, 3), or a clip with one for each frame of the file. ClipError or
    ImageError is raised if it cannot be read.
    """
    if background.image is not None:
        return open_plates(background, camera) or read_image(background.image)
    return None if background.color is None else np.array(background.color, np.float32)


def mean_of_frames(numbers: Sequence[int], clip: Clip) -> Picture:
    """Return the mean (rows, columns, 3) of frames of a clip's file, as they were filmed; ClipError if one lacks."""
    whole = clip.whole().as_filmed()
    for number in numbers:
        if number >= len(whole):
            raise ClipError(
                f"{clip.path}: has no frame {number} to take the background from; choose one of 0 to {len(whole) - 1}"
            )
    return np.asarray(sum(whole.frame(number) for number in numbers) / np.float32(len(numbers)), np.float32)


def background_picture(scene: Scene, camera: Camera | None = None) -> Picture:
    """Return the linear background as a camera sees it: (rows, columns, 3), or (3,) if it is one color.

    A plate that changes is shown at the clip's first frame; without a background it is black. The camera is by default
    the scene's own; `behind` says what another one sees of a clean plate. ImageError or ClipError is raised if the
    plate cannot be read.
    """
    picture = None if scene.background is None else read_background(scene.background, scene.camera)
    if isinstance(picture, Clip):
        with picture as plates:
            picture = plates.frame(scene.clip.first if scene.clip is not None else 0)
    if picture is None or picture.ndim == 1:
        return np.zeros(3, np.float32) if picture is None else picture
    own = scene.camera
    if own is None:
        return picture if camera is None else np.asarray(picture.mean((0, 1)))
    return behind(picture, own.at(0), camera if camera is not None and not camera.moves else own.at(0))


def behind(plate: Picture, own: Camera, camera: Camera) -> Picture:
    """Return what a camera sees of a clean plate (rows, columns, 3) that its ``own`` camera filmed.

    A camera at the same place whose picture is a part of the plate's, at any resolution, sees that part,
    (rows, columns, 3). Any other sees the plate's mean color, (3,).
    """
    part = shared_part(own, camera)
    if part is None:
        return np.asarray(plate.mean((0, 1)))
    return area_average(area_average(plate, *own.size)[part], *camera.size)


def continued_color(color: Picture, clip: Clip) -> Picture | None:
    """Return a linear color (3,) as a picture (rows, columns, 3), as what is seen beside a clip's mask has it.

    No smoke is there, so it shows how the color changes over the picture: that is continued behind the smoke. The more
    it differs from the color, the likelier it is something else, such as a forest below the sky, and the less it says.
    None where hardly anything there has the color.
    """
    size, filmed, given = reduced_size(*clip.size, SIDE), clip.as_filmed(), linear_to_srgb(color)
    changes = []
    for number in clip.spread(FRAMES):
        change = linear_to_srgb(filmed.stored(number).averaged(*size)) - given
        changes.append(np.where(np.isnan(clip.as_seen(number, change)), change, np.float32(np.nan)))
    beside = median_of_seen(np.stack(changes))
    away = np.sqrt(channel_mean(np.square(beside)))
    if np.count_nonzero(away < ALIKE) < MIN_BESIDE * away.size:
        return None
    weight = np.where(away < FARTHEST, np.exp(-0.5 * np.square(away / np.float32(COLOR_SPREAD))), np.float32(0))
    total = weight + np.float32(COLOR_WEIGHT)
    change = push_pull(np.nan_to_num(beside) * (weight / total)[..., None], np.minimum(total, 1))
    return srgb_to_linear(np.maximum(given + area_average(change, *clip.size), 0))


def single_color(plate: Picture) -> Picture | None:
    """Return the linear color (3,) of a clean plate (rows, columns, 3) of one color; None of any other plate."""
    color = np.asarray(np.median(plate.reshape(-1, 3), axis=0), np.float32)
    alike = (np.abs(linear_to_srgb(plate) - linear_to_srgb(color)) <= ALIKE).all(-1)
    return color if alike.mean() >= MIN_ALIKE_FRACTION else None


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
        low, middle, high = np.moveaxis(np.sort(values, axis=-1), -1, 0)
        painted = opaque & (high - middle >= PAINTED)
        if not painted.any():
            raise ClipError(f"{path}: no stroke is green (smoke), red (not smoke) or blue (behind); use pure colors.")
        # the edge between two strokes is as thin as a pixel or two
        mixed = opaque & ~painted & (middle - low >= PAINTED)
        if ndimage.binary_opening(mixed, np.ones((3, 3))).any():
            raise ClipError(
                f"{path}: some strokes are neither green (smoke), red (not smoke) nor blue (behind); use pure colors."
            )
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
