"""The buttons that add a smoke, choose one, make it and stop that."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, StringProperty

from . import run, shot_check, smoke_takes
from .blender_scene import ShotError
from .clip_table import frame_count
from .editors import open_tab
from .needs import NeedsClip
from .properties import SEEDS
from .smoke import activate, active_smoke, new_smoke, smokes
from .take import Take, TakeError


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


class SMOKELIFT_OT_use_all_files(NeedsClip, bpy.types.Operator):
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


class SMOKELIFT_OT_run(NeedsClip, bpy.types.Operator):
    """Turn the clip into a volume of smoke. Blender stays usable meanwhile"""

    bl_idname = "smokelift.run"
    bl_label = "Make Smoke"
    bl_options = {"UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        return _make_smoke(self, context)


class SMOKELIFT_OT_vary(NeedsClip, bpy.types.Operator):
    """Make the smoke again with the next variation: it looks the same from the camera, and different from the side"""

    bl_idname = "smokelift.vary"
    bl_label = "Another Variation"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if active_smoke(context.scene).smokelift.detail == 0.0:
            cls.poll_message_set("Without detail in depth there is only one smoke: raise Depth Detail first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = active_smoke(context.scene).smokelift
        before = settings.seed
        settings.seed = (before + 1) % SEEDS
        outcome = _make_smoke(self, context)
        if outcome == {"CANCELLED"}:
            settings.seed = before
        return outcome


def _make_smoke(operator: bpy.types.Operator, context: bpy.types.Context) -> set[str]:
    """Write a take and queue it; the operator reports what is in the way."""
    smoke = active_smoke(context.scene)
    try:
        take = smoke_takes.write_take(smoke)
    except (ShotError, TakeError) as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    run.enqueue(context, smoke, take)
    return {"FINISHED"}


class SMOKELIFT_OT_resume(NeedsClip, bpy.types.Operator):
    """Resume the stopped run after its last finished frame, with its own settings"""

    bl_idname = "smokelift.resume"
    bl_label = "Resume"

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        take = smoke_takes.unfinished(smoke)
        if take is None or smoke_takes.busy(context.window_manager, take):
            self.report({"ERROR"}, "No stopped run to resume: press Make Smoke.")
            return {"CANCELLED"}
        try:
            smoke_takes.update_moved_files(smoke, take)
        except TakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        run.enqueue(context, smoke, take)
        return {"FINISHED"}


class SMOKELIFT_OT_cancel(bpy.types.Operator):
    """Stop the run. Finished frames stay, and Resume continues after them"""

    bl_idname = "smokelift.cancel"
    bl_label = "Stop Making Smoke?"
    bl_options = {"INTERNAL"}

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.take:
            return self.execute(context)
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        jobs = context.window_manager.smokelift.jobs
        for place in reversed(range(len(jobs))):
            row = jobs[place]
            if row.take != self.take and (self.take or row.outcome != "running"):
                continue
            if row.outcome == "waiting":  # it leaves nothing behind
                Take(Path(row.take)).remove_unless_begun()
                jobs.remove(place)
            else:
                row.cancel = True
        return {"FINISHED"}


class SMOKELIFT_OT_check(NeedsClip, bpy.types.Operator):
    """Estimate time, memory and disk space of the run, and list its assumptions"""

    bl_idname = "smokelift.check"
    bl_label = "Check Shot"
    bl_options = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        state = context.window_manager.smokelift
        smoke = active_smoke(context.scene)
        state.check_smoke, state.check_place = smoke.session_uid, shot_check.place(smoke)
        state.check_ticks = shot_check.TICKS
        run.work(context)
        return {"FINISHED"}


class SMOKELIFT_OT_show_smoke(bpy.types.Operator):
    """Select this smoke, and show its settings in the tab"""

    bl_idname = "smokelift.show_smoke"
    bl_label = "Select Smoke"
    bl_options = {"REGISTER", "UNDO"}

    smoke: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        found = next((obj for obj in smokes(context.scene) if obj.name == self.smoke), None)
        if found is None:
            self.report({"ERROR"}, rpt_("The scene has no smoke of the name {:s}.").format(self.smoke))
            return {"CANCELLED"}
        activate(found, context.scene)
        return {"FINISHED"}


_CLASSES = (
    SMOKELIFT_OT_add,
    SMOKELIFT_OT_use_all_files,
    SMOKELIFT_OT_run,
    SMOKELIFT_OT_vary,
    SMOKELIFT_OT_resume,
    SMOKELIFT_OT_cancel,
    SMOKELIFT_OT_check,
    SMOKELIFT_OT_show_smoke,
)

_register, _unregister = bpy.utils.register_classes_factory(_CLASSES)


def register() -> None:
    """Register the operators and what is in Blender's menus."""
    _register()
    bpy.types.VIEW3D_MT_volume_add.append(_draw_add)


def unregister() -> None:
    bpy.types.VIEW3D_MT_volume_add.remove(_draw_add)
    _unregister()
