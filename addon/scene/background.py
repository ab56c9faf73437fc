"""What is behind the smoke in a scene file: a clean plate, frames or a color that is given, and strokes on the clip.

Strokes say where smoke is, where none is, and where the background is seen. Blender shows no picture below one that is
painted, so the frame is in the image itself, in pale colors: what has a strong color is a stroke. The file has the
strokes alone, with alpha. It is written whenever the engine is about to read it.
"""

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import numpy.typing as npt

from ..core import ShotError
from .blender import absolute, file_of, relative
from .clip import frame_count, number_in_file

SATURATION = 0.25  # fraction of the frame's saturation that is kept below the strokes
MIN_STROKE = 0.5  # smallest alpha of a stroke, and smallest difference of its channels: twice that of the frame below
WRITTEN = "smokelift_written"  # custom property of an image with a frame below: its file's time when written
Pixels = npt.NDArray[np.float32]  # red, green, blue and alpha of an image, (pixels, 4)


def background_table(smoke: bpy.types.Object) -> dict[str, Any]:
    """The table; empty where the engine estimates the background. ShotError if a picture or a frame is missing."""
    settings, table = smoke.smokelift, {}
    if settings.plate_mode == "FILE":
        if not settings.plate:
            raise ShotError("Choose the clean plate, or choose From the Clip.")
        file = absolute(settings.plate)
        if not file.is_file():
            raise ShotError(f"The clean plate {file} is not there: choose it again.")
        table["image"] = str(file)
    elif settings.plate_mode == "FRAMES":
        table["frame"] = [number_in_file(settings.clip, number) for number in _clean_frames(settings)]
    elif settings.plate_mode == "COLOR":
        table["color"] = list(settings.plate_color)
    if settings.strokes is not None:
        table["strokes"] = str(saved_strokes(settings.strokes, settings.clip))
    return table


def _clean_frames(settings: bpy.types.PropertyGroup) -> list[int]:
    """The chosen frames, counted from 1 as in the panel."""
    words = settings.plate_frames.replace(",", " ").split()
    if not words:
        raise ShotError("Go to a frame without smoke and press Plate from This Frame, or choose another Background.")
    count = frame_count(settings.clip)
    if not all(word.isdecimal() and 1 <= int(word) <= count for word in words):
        raise ShotError(
            f"Frames {settings.plate_frames} are not in the clip: it has frames 1 to {count}, separated by commas."
        )
    return sorted({int(word) for word in words})


def saved_strokes(image: bpy.types.Image, clip: bpy.types.MovieClip) -> Path:
    """The file of the strokes on a clip, with what was painted last; ShotError if it is missing or of another size."""
    file = file_of(image)
    try:
        if WRITTEN in image:
            if image.is_dirty or image[WRITTEN] != _time(file):
                if image.is_dirty:
                    image.save()  # or Blender asks for it at its end
                _save(strokes_in(_pixels(image)), tuple(image.size), file)
                image[WRITTEN] = _time(file)
        elif image.is_dirty and image.filepath and image.packed_file is None:
            image.save()
    except RuntimeError as error:
        raise ShotError(f"The strokes {file} cannot be written: save them elsewhere in the Image Editor.") from error
    if not file.is_file():
        raise ShotError(f"The strokes {image.name} are in no file: save them in the Image Editor, or clear Strokes.")
    if tuple(image.size) != tuple(clip.size):
        raise ShotError(
            f"The strokes have {image.size[0]} x {image.size[1]} pixels, and the clip {clip.size[0]} x {clip.size[1]}: "
            "paint new ones, or clear Strokes."
        )
    return file


def strokes_at(file: Path, size: tuple[int, int]) -> bpy.types.Image:
    """The image of the strokes in a file; where there is none, it is written without any."""
    known = file.is_file()
    if not known:
        file.parent.mkdir(parents=True, exist_ok=True)
        _save(np.zeros((size[0] * size[1], 4), np.float32), size, file)
    image = bpy.data.images.load(str(file), check_existing=known)
    image.filepath = relative(file)
    return image


def lay_below(image: bpy.types.Image, picture: Path) -> None:
    """Put a picture of its size below the strokes of an image whose file has them all."""
    filmed = bpy.data.images.load(str(picture))
    values, strokes = _pixels(filmed), strokes_in(_pixels(image))
    bpy.data.images.remove(filmed)
    gray = values[:, :3].mean(1, keepdims=True)
    values[:, :3] = gray + SATURATION * (values[:, :3] - gray)
    painted = strokes[:, 3] > 0.0
    values[painted] = strokes[painted]
    image.pixels.foreach_set(values.ravel())
    image.update()
    image[WRITTEN] = _time(absolute(image.filepath))


def strokes_in(values: Pixels) -> Pixels:
    """The strokes in an image, in pure colors, and transparent elsewhere."""
    colors = values[:, :3]
    painted = (values[:, 3] > MIN_STROKE) & (np.ptp(colors, axis=1) > MIN_STROKE)
    strokes = np.zeros_like(values)
    strokes[painted, colors.argmax(1)[painted]] = strokes[painted, 3] = 1.0
    return strokes


def _save(values: Pixels, size: tuple[int, int], file: Path) -> None:
    image = bpy.data.images.new(file.stem, *size, alpha=True)
    image.pixels.foreach_set(values.ravel())
    image.filepath_raw, image.file_format = str(file), "PNG"
    image.save()
    bpy.data.images.remove(image)


def _pixels(image: bpy.types.Image) -> Pixels:
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(-1, 4)


def _time(file: Path) -> str:
    """When a file was changed last, as a text: Blender's properties hold 32 bits."""
    return str(file.stat().st_mtime_ns) if file.is_file() else ""
