"""The footage in a scene file: the clip with its frames and rate, what is behind its smoke, and strokes painted on it.

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
from ..core.contract import PANORAMA_SUFFIXES, ImageSequence, image_sequence_from
from .blender import absolute, file_of, frame_rate, relative
from .smoke import scene_of

TRANSFERS = {"sRGB": "srgb", "Linear Rec.709": "linear", "scene_linear": "linear", "Non-Color": "linear"}
"""The engine's name of the transfer function of a clip's pixels, by Blender's color space."""

SATURATION = 0.25  # fraction of the frame's saturation that is kept below the strokes
MIN_STROKE = 0.5  # smallest alpha of a stroke, and lead of its channel over the next: twice the frame's
WRITTEN = "smokelift_written"  # custom property of an image with a frame below: its file's time when written
Pixels = npt.NDArray[np.float32]  # red, green, blue and alpha of an image, (pixels, 4)


def clip_table(smoke: bpy.types.Object) -> dict[str, Any]:
    """The clip and its used frames, counted from 0."""
    settings = smoke.smokelift
    clip = settings.clip
    if clip is None:
        raise ShotError("Choose a clip first.")
    path, count = file_of(clip), frame_count(clip)
    if not 1 <= settings.first <= settings.last <= count:
        raise ShotError(f"Frames {settings.first} to {settings.last} are not in the clip: it has frames 1 to {count}.")
    frames = [number_in_file(clip, number) for number in (settings.first, settings.last)]
    table: dict[str, Any] = {"path": str(path), "frames": frames}
    if settings.fps > 0.0:
        table["fps"] = settings.fps
    elif clip.source == "SEQUENCE":
        table["fps"] = frame_rate(scene_of(smoke))
    transfer = _transfer(clip) if settings.transfer == "AUTO" else settings.transfer
    if transfer is not None:
        table["transfer"] = transfer
    return table


def _transfer(clip: bpy.types.MovieClip) -> str | None:
    """The transfer function that the clip's color space says; None for the one that its kind of file has."""
    space = clip.colorspace_settings.name
    if not space:  # the color management of this Blender does not know it
        return None
    if space not in TRANSFERS:
        raise ShotError(
            f"The clip's color space is {space}, and only sRGB and Linear Rec.709 can be read: convert the clip, or "
            "choose another Color Space under Advanced."
        )
    usual = "linear" if file_of(clip).suffix.lower() in PANORAMA_SUFFIXES else "srgb"
    return None if TRANSFERS[space] == usual else TRANSFERS[space]


def number_in_file(clip: bpy.types.MovieClip, number: int) -> int:
    """The number in the clip's file, from 0 as the engine counts, of a frame that is counted from 1."""
    return number + clip.frame_offset - 1


def shown_frame(smoke: bpy.types.Object) -> int:
    """The frame of the clip that the scene shows now, counted from 1; ShotError if it shows none."""
    clip, now = smoke.smokelift.clip, scene_of(smoke).frame_current
    start, count = clip.frame_start, frame_count(clip)
    if not start <= now < start + count:
        raise ShotError(f"The clip is not seen in frame {now}: go to one from {start} to {start + count - 1}.")
    return now - start + 1


def _sequence_of(clip: bpy.types.MovieClip) -> ImageSequence | None:
    """The pictures of a clip, also those after a gap, at which it ends for Blender; None of a video."""
    return image_sequence_from(file_of(clip)) if clip.source == "SEQUENCE" else None


def unseen_pictures(settings: bpy.types.PropertyGroup) -> ImageSequence | None:
    """The pictures of a smoke's clip where it is used to its end for Blender or beyond, and there is a gap or more."""
    found, known = _sequence_of(settings.clip), settings.clip.frame_duration
    if found is None or settings.last < known or (found.count <= known and not found.missing):
        return None
    return found


def frame_count(clip: bpy.types.MovieClip) -> int:
    """The number of frames of a clip, also of those that Blender does not find; ShotError if it cannot be read."""
    path = file_of(clip)
    if not path.is_file():
        raise ShotError(f"The clip {path} is not there: choose it again, or use File > External Data.")
    if clip.frame_duration < 1:  # Blender takes any file for a clip
        raise ShotError(f"The clip {path} is no video and no picture that Blender can read: choose another.")
    found = _sequence_of(clip)
    return clip.frame_duration if found is None else max(clip.frame_duration, found.count)


def use_frames(smoke: bpy.types.Object, first: int, last: int) -> None:
    """Use frames of the clip's file, counted from 0 as the engine does; ShotError if the clip does not have them."""
    settings = smoke.smokelift
    lowest = settings.clip.frame_offset
    highest = lowest + frame_count(settings.clip) - 1
    if not lowest <= first <= last <= highest:
        raise ShotError(f"Frames {first} to {last} are not in the clip: it has frames {lowest} to {highest}, from 0.")
    settings.first, settings.last = first - lowest + 1, last - lowest + 1


def start_frame(settings: bpy.types.PropertyGroup) -> int:
    """The scene's frame that shows the first used frame of the clip."""
    return settings.clip.frame_start + settings.first - 1


def used_range(settings: bpy.types.PropertyGroup) -> tuple[int, int] | None:
    """The scene's frames that show the first and the last used frame of the clip; None without one."""
    if settings.clip is None:
        return None
    return start_frame(settings), settings.clip.frame_start + settings.last - 1


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
                _save(_strokes_in(_pixels(image)), tuple(image.size), file)
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
    values, strokes = _pixels(filmed), _strokes_in(_pixels(image))
    bpy.data.images.remove(filmed)
    gray = values[:, :3].mean(1, keepdims=True)
    values[:, :3] = gray + SATURATION * (values[:, :3] - gray)
    painted = strokes[:, 3] > 0.0
    values[painted] = strokes[painted]
    image.pixels.foreach_set(values.ravel())
    image.update()
    image[WRITTEN] = _time(absolute(image.filepath))


def _strokes_in(values: Pixels) -> Pixels:
    """The strokes in an image, in pure colors, and transparent elsewhere; mixed ones stay, which the engine refuses."""
    colors, opaque = values[:, :3], values[:, 3] > MIN_STROKE
    low, middle, high = np.sort(colors, axis=1).T
    pure, mixed = (opaque & (above - below > MIN_STROKE) for above, below in ((high, middle), (middle, low)))
    strokes = np.where(mixed[:, None], values, np.float32(0))
    strokes[pure] = 0.0
    strokes[pure, colors.argmax(1)[pure]] = strokes[pure | mixed, 3] = 1.0
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
