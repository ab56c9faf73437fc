"""The clip in the tab: its frames, its background, its mask and its lens."""

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, StringProperty

from ..result import shot_check, smoke_takes
from ..scene import shot_setup
from ..scene.blender import ShotError, frame_rate
from ..scene.clip import clip_path, frame_count, shown_frame, unseen_pictures
from ..scene.pictures import is_distorted, undistorted
from ..scene.smoke import active_smoke, new_smoke
from .editors import open_tab, show_mask
from .layout import RequiresClip, draw_text


class SMOKELIFT_OT_add(bpy.types.Operator):
    """Add smoke that is made from a video or an image sequence"""

    bl_idname = "smokelift.add"
    bl_label = "Smoke from Video"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_movie: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if self.filepath:  # of a video that was dropped
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        text = rpt_("{:s} is no video and no picture that Blender can read: choose another.")
        try:
            clip = bpy.data.movieclips.load(self.filepath, check_existing=True)
        except RuntimeError:
            self.report({"ERROR"}, text.format(self.filepath))
            return {"CANCELLED"}
        if clip.frame_duration < 1:  # Blender takes any file for a clip
            self.report({"ERROR"}, text.format(self.filepath))
            if clip.users == 0:
                bpy.data.movieclips.remove(clip)
            return {"CANCELLED"}
        new_smoke(context.scene, clip)
        if not bpy.app.background and context.area is not None and context.area.type == "VIEW_3D":
            open_tab(context.area)
        return {"FINISHED"}


def _draw_add(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator(SMOKELIFT_OT_add.bl_idname, text="Smoke from Video...", icon="FILE_MOVIE")


class SMOKELIFT_OT_use_all_files(RequiresClip, bpy.types.Operator):
    """Use all pictures of the sequence, also those after missing ones, where it ends for Blender"""

    bl_idname = "smokelift.use_all_files"
    bl_label = "Use All Files"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = active_smoke(context.scene).smokelift
        try:
            settings.last = frame_count(settings.clip)
        except ShotError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class SMOKELIFT_OT_match_clip(RequiresClip, bpy.types.Operator):
    """Set the scene's resolution and frame rate to the clip's, and its length to the result's or its part in use"""

    bl_idname = "smokelift.match_clip"
    bl_label = "Match Scene to Clip"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        shot_setup.match_clip(active_smoke(context.scene))
        shot_check.check_again(context)
        return {"FINISHED"}


UNCHANGED = ("first", "last", "folder", "fps", "plate_frames")
"""Settings that a clip of the same frames keeps."""


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
        clip, kept = settings.clip, {name: getattr(settings, name) for name in UNCHANGED}
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


class SMOKELIFT_OT_plate_from_frame(RequiresClip, bpy.types.Operator):
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


class SMOKELIFT_OT_clear_plate_frames(RequiresClip, bpy.types.Operator):
    """Take none of these frames as the clean plate"""

    bl_idname = "smokelift.clear_plate_frames"
    bl_label = "Clear Frames"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = active_smoke(context.scene).smokelift
        settings.plate_frames, settings.plate_mode = "", "ESTIMATE"
        return {"FINISHED"}


class SMOKELIFT_OT_new_mask(RequiresClip, bpy.types.Operator):
    """Draw over the clip, in the Clip Editor, where smoke may be. Where the mask is black there is none"""

    bl_idname = "smokelift.new_mask"
    bl_label = "New Mask"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        settings = smoke.smokelift
        if settings.drawn_mask is None:
            mask = bpy.data.masks.new(smoke.name)
            mask.layers.new(name="Smoke")
            mask.frame_start, mask.frame_end = context.scene.frame_start, context.scene.frame_end
            settings.drawn_mask = mask
        if not bpy.app.background:
            open_tab(show_mask(settings.clip, settings.drawn_mask))
        return {"FINISHED"}


def draw_clip(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    scene, settings = context.scene, smoke.smokelift
    clip = settings.clip
    if not clip_path(clip).is_file():
        draw_text(
            layout, context, iface_("{:s} is not there: choose the clip again.").format(str(clip_path(clip))), "ERROR"
        )
    row = layout.row(align=True)
    row.prop(settings, "first", text="Frames")
    row.prop(settings, "last", text="")
    _draw_gaps(layout, context, settings)
    if is_distorted(clip):
        column = layout.column(align=True)
        draw_text(
            column,
            context,
            "The clip's lens bends lines, and smoke is made for one that does not: undistort it.",
            "INFO",
        )
        column.operator("smokelift.undistort")
    size = (scene.render.resolution_x, scene.render.resolution_y)
    other_rate = clip.source == "MOVIE" and abs(clip.fps - frame_rate(scene)) > 0.01
    if size != tuple(clip.size) or other_rate:
        column = layout.column(align=True)
        if clip.source == "MOVIE":
            text = iface_("The clip has {:d} x {:d} pixels at {:g} frames a second, the scene {:d} x {:d} at {:g}.")
            text = text.format(*clip.size, clip.fps, *size, frame_rate(scene))
            if size == tuple(clip.size):
                text = iface_("The clip has {:g} frames a second, the scene {:g}.").format(clip.fps, frame_rate(scene))
        else:  # pictures have no frame rate of their own
            text = iface_("The clip has {:d} x {:d} pixels, the scene {:d} x {:d}.").format(*clip.size, *size)
        draw_text(column, context, text, "INFO")
        column.operator("smokelift.match_clip")


def _draw_gaps(layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup) -> None:
    """Pictures that are missing in a sequence, and the button that uses those after them."""
    found = unseen_pictures(settings)
    if found is None:
        return
    column = layout.column(align=True)
    if found.missing:
        draw_text(column, context, iface_("Missing: {:s}.").format(found.missing_names()), "ERROR")
    if settings.last < found.count:
        text = iface_("Blender sees {:d} of {:d} frames.").format(settings.clip.frame_duration, found.count)
        draw_text(column, context, text, "BLANK1" if found.missing else "INFO")
        column.operator("smokelift.use_all_files")
    else:
        draw_text(column, context, "A neighboring picture stands in for each.", "BLANK1")


def draw_mask(layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup) -> None:
    """The mask that is drawn, and which side of it is smoke; without one, the field for a file."""
    drawn = settings.drawn_mask is not None
    row = layout.row(align=True)
    row.prop(settings, "drawn_mask")
    row.operator("smokelift.new_mask", text="" if drawn else "New", icon="GREASEPENCIL" if drawn else "ADD")
    if drawn:
        draw_text(layout, context, "Smoke may be inside its lines; outside, if its layer is inverted.", "INFO")
    else:
        layout.prop(settings, "mask", text=" ", placeholder=iface_("white is smoke"))


_CLASSES = (
    SMOKELIFT_OT_add,
    SMOKELIFT_OT_use_all_files,
    SMOKELIFT_OT_match_clip,
    SMOKELIFT_OT_undistort,
    SMOKELIFT_OT_plate_from_frame,
    SMOKELIFT_OT_clear_plate_frames,
    SMOKELIFT_OT_new_mask,
)

_register, _unregister = bpy.utils.register_classes_factory(_CLASSES)


def register() -> None:
    """Register the operators and what is in Blender's menus."""
    _register()
    bpy.types.VIEW3D_MT_volume_add.append(_draw_add)


def unregister() -> None:
    bpy.types.VIEW3D_MT_volume_add.remove(_draw_add)
    _unregister()
