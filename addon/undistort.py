"""A clip without its lens's distortion, written by Blender's own Movie Clip nodes.

The engine's camera is a pinhole. Where the clip's lens was calibrated in the Movie Clip Editor, such a camera films the
undistorted pictures.
"""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import smoke_takes
from .clip_pictures import write_pictures
from .smoke import active_smoke

KEPT = ("first", "last", "folder", "fps", "plate_frames")
"""Settings that a clip of the same frames keeps."""

COEFFICIENTS = {
    "POLYNOMIAL": ("k1", "k2", "k3"),
    "DIVISION": ("division_k1", "division_k2"),
    "NUKE": ("nuke_k1", "nuke_k2"),
    "BROWN": ("brown_k1", "brown_k2", "brown_k3", "brown_k4", "brown_p1", "brown_p2"),
}
"""Names of a lens's coefficients by its distortion model."""


def is_distorted(clip: bpy.types.MovieClip) -> bool:
    """Whether a clip's lens was calibrated, and bends lines."""
    lens = clip.tracking.camera
    return any(getattr(lens, name) != 0.0 for name in COEFFICIENTS.get(lens.distortion_model, ()))


def undistorted(clip: bpy.types.MovieClip, folder: Path) -> bpy.types.MovieClip:
    """Write a clip's undistorted pictures (PNG, 16 bits) into a folder; returns them as a clip of the same frames."""
    last = clip.frame_start + clip.frame_duration - 1
    made = bpy.data.movieclips.load(
        str(write_pictures(clip, clip.frame_start, last, folder / "undistorted_", undistort=True))
    )
    made.name = f"{clip.name} undistorted"
    made.frame_start = clip.frame_start
    for name in ("sensor_width", "focal_length", "pixel_aspect"):
        setattr(made.tracking.camera, name, getattr(clip.tracking.camera, name))
    return made


class SMOKELIFT_OT_undistort(bpy.types.Operator):
    """Write the clip without its lens's distortion, and use that. Blender waits meanwhile"""

    bl_idname = "smokelift.undistort"
    bl_label = "Undistort Clip"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        if smoke is None or smoke.smokelift.clip is None or not is_distorted(smoke.smokelift.clip):
            cls.poll_message_set("The clip's lens has no distortion: calibrate it in the Movie Clip Editor")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        settings = smoke.smokelift
        if settings.plate_mode == "FILE":
            self.report({"ERROR"}, "The clean plate is distorted too: choose Background: From the Clip first.")
            return {"CANCELLED"}
        if settings.mask or settings.drawn_mask is not None:
            self.report({"ERROR"}, "The mask is distorted too: clear it, and draw one over the undistorted clip.")
            return {"CANCELLED"}
        if settings.strokes is not None:
            self.report({"ERROR"}, "The strokes are distorted too: clear them, and paint new ones afterwards.")
            return {"CANCELLED"}
        clip, kept = settings.clip, {name: getattr(settings, name) for name in KEPT}
        folder = smoke_takes.output_folder(smoke) / "undistorted"
        try:
            settings.clip = undistorted(clip, folder)
        except RuntimeError:
            self.report({"ERROR"}, rpt_("{:s} cannot be written to: choose another Output.").format(str(folder)))
            return {"CANCELLED"}
        if clip.source == "MOVIE" and not kept["fps"]:
            kept["fps"] = clip.fps  # pictures have no rate of their own
        for name, value in kept.items():
            setattr(settings, name, value)
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_undistort,))
