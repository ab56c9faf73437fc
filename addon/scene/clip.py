"""The clip in a scene file: its path, the frames that are used, their rate and their transfer function."""

from typing import Any

import bpy

from ..core import ShotError
from ..core.contract import PANORAMA_SUFFIXES, ImageSequence, image_sequence_from
from .blender import file_of, frame_rate
from .smoke import scene_of

TRANSFERS = {"sRGB": "srgb", "Linear Rec.709": "linear", "scene_linear": "linear", "Non-Color": "linear"}
"""The engine's name of the transfer function of a clip's pixels, by Blender's color space."""


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


def sequence_of(clip: bpy.types.MovieClip) -> ImageSequence | None:
    """The pictures of a clip, also those after a gap, at which it ends for Blender; None of a video."""
    return image_sequence_from(file_of(clip)) if clip.source == "SEQUENCE" else None


def unseen_pictures(settings: bpy.types.PropertyGroup) -> ImageSequence | None:
    """The pictures of a smoke's clip where it is used to its end for Blender or beyond, and there is a gap or more."""
    found, known = sequence_of(settings.clip), settings.clip.frame_duration
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
    found = sequence_of(clip)
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
