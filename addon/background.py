"""The background in a scene file: a clean plate, frames of the clip without smoke, and strokes that help to find it."""

from pathlib import Path
from typing import Any

import bpy

from .blender_scene import ShotError
from .clip_table import frame_count, number_in_file, shown_frame
from .needs import NeedsClip
from .paths import absolute
from .smoke import active_smoke
from .strokes import saved_strokes


def background_table(smoke: bpy.types.Object) -> dict[str, Any]:
    """The table; empty where the engine estimates the background.

    Raises
    ------
    ShotError
        If a picture is missing, or the clip does not have the frames.
    """
    settings, table = smoke.smokelift, {}
    if settings.plate_mode == "FILE":
        table["image"] = str(_plate(settings.plate))
    elif settings.plate_mode == "FRAMES":
        table["frame"] = [number_in_file(settings.clip, number) for number in _frames(settings)]
    if settings.strokes is not None:
        table["strokes"] = str(saved_strokes(settings.strokes, settings.clip))
    return table


def _plate(path: str) -> Path:
    if not path:
        raise ShotError("Choose the clean plate, or choose From the Clip.")
    file = absolute(path)
    if not file.is_file():
        raise ShotError(f"The clean plate {file} is not there: choose it again.")
    return file


def _frames(settings: bpy.types.PropertyGroup) -> list[int]:
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


class SMOKELIFT_OT_plate_from_frame(NeedsClip, bpy.types.Operator):
    """Take this frame of the clip, in which there is no smoke, as the clean plate. More frames lessen the noise"""

    bl_idname = "smokelift.plate_from_frame"
    bl_label = "Plate from This Frame"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        settings = smoke.smokelift
        try:
            number = shown_frame(smoke)
        except ShotError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        chosen = settings.plate_frames.replace(",", " ").split() if settings.plate_mode == "FRAMES" else []
        if str(number) not in chosen:
            chosen.append(str(number))
        settings.plate_frames, settings.plate_mode = ", ".join(chosen), "FRAMES"
        return {"FINISHED"}


class SMOKELIFT_OT_clear_plate_frames(NeedsClip, bpy.types.Operator):
    """Take none of these frames as the clean plate"""

    bl_idname = "smokelift.clear_plate_frames"
    bl_label = "Clear Frames"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = active_smoke(context.scene).smokelift
        settings.plate_frames, settings.plate_mode = "", "ESTIMATE"
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory(
    (SMOKELIFT_OT_plate_from_frame, SMOKELIFT_OT_clear_plate_frames)
)
