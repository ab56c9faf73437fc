"""Runs in the tab: the buttons that make smoke and stop that, and the queue."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import StringProperty

from ..core.job import ENDED
from ..core.take import Take, TakeError
from ..result import run_queue, smoke_takes
from ..scene import volume
from ..scene.blender import ShotError
from ..scene.modifiers import lacks_proxy
from ..scene.smoke import active_smoke, find_smoke
from .common import ActsOnSmoke, RequiresClip, refuse
from .layout import draw_doubt, draw_failure, draw_progress, draw_text
from .quality_panel import SEEDS


class SMOKELIFT_OT_run(ActsOnSmoke, RequiresClip, bpy.types.Operator):
    """Turn the clip into a volume of smoke. Blender stays usable meanwhile"""

    bl_idname = "smokelift.run"
    bl_label = "Make Smoke"
    bl_options = {"UNDO"}

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        run_queue.enqueue(context, smoke, smoke_takes.write_take(smoke))


class SMOKELIFT_OT_vary(ActsOnSmoke, RequiresClip, bpy.types.Operator):
    """Make the smoke again with the next variation: it looks the same from the camera, and different from the side"""

    bl_idname = "smokelift.vary"
    bl_label = "Another Variation"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if active_smoke(context.scene).smokelift.detail == 0.0:
            return refuse(cls, "Without detail in depth there is only one smoke: raise Depth Detail first")
        return True

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        before = smoke.smokelift.seed
        smoke.smokelift.seed = (before + 1) % SEEDS
        try:
            take = smoke_takes.write_take(smoke)
        except (ShotError, TakeError):
            smoke.smokelift.seed = before
            raise
        run_queue.enqueue(context, smoke, take)


class SMOKELIFT_OT_resume(ActsOnSmoke, RequiresClip, bpy.types.Operator):
    """Resume the stopped run after its last finished frame, with its own settings"""

    bl_idname = "smokelift.resume"
    bl_label = "Resume"

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        take = smoke_takes.unfinished(smoke)
        if take is None or smoke_takes.busy(context.window_manager, take):
            raise ShotError("No stopped run to resume: press Make Smoke.")
        smoke_takes.update_moved_files(smoke, take)
        run_queue.enqueue(context, smoke, take)


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


def draw_run(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    jobs = context.window_manager.smokelift.jobs
    own = [row for row in jobs if row.smoke_uid == smoke.session_uid]
    column = layout.column()
    column.scale_y = 1.5
    if all(row.outcome in ENDED for row in own):
        begun = smoke_takes.unfinished(smoke)
        if begun is not None and begun.read().frames:
            last = volume.frames_before_take(smoke, begun) + begun.read().frames
            text = iface_("Resume after Frame {:d}").format(last)
            column.operator("smokelift.resume", text=text, translate=False, icon="FILE_REFRESH")
            column.operator("smokelift.run", text="Start Again", icon="PLAY")
        else:
            column.operator("smokelift.run", text="Make Smoke", icon="PLAY")
    else:
        column.operator("smokelift.run", text="Make Another After This", icon="PLAY")
    for row in jobs:
        _draw_job(layout, context, smoke, row)
    if volume.shown_take(smoke) is not None:
        layout.operator("smokelift.set_up", icon="CAMERA_DATA")
        seen = volume.shown_range(smoke)
        if seen and smoke.data.sequence_mode == "CLIP" and not seen[0] <= context.scene.frame_current <= seen[1]:
            text = iface_("The smoke is seen in frames {:d} to {:d}.")
            draw_text(layout, context, text.format(*seen), "INFO")
        known = volume.provenance_note(smoke)
        if known:
            draw_text(layout, context, known, "INFO")
        index = volume.shown_take(smoke).read().index
        if index and index["complete"]:
            layout.operator("smokelift.vary", icon="MOD_NOISE")
            if lacks_proxy(smoke, index):
                column = layout.column(align=True)
                draw_text(column, context, "This smoke is large: a proxy keeps the viewport fast.", "INFO")
                column.operator("smokelift.make_proxy", icon="MOD_REMESH")


def _draw_job(
    layout: bpy.types.UILayout, context: bpy.types.Context, shown: bpy.types.Object, row: bpy.types.PropertyGroup
) -> None:
    box = layout.box()
    smoke = find_smoke(row.smoke_uid)
    if smoke is not None and smoke != shown:
        box.label(text=smoke.name, icon="VOLUME_DATA")
    if row.outcome == "waiting":
        box.label(text="Queued", icon="SORTTIME")
    elif row.outcome == "running":
        draw_progress(box, row)
    elif row.outcome == "failed":
        draw_failure(box, context, row.sentence)
    else:
        draw_text(box, context, row.sentence, "INFO")
    if row.icon:
        box.template_icon(icon_value=row.icon, scale=8.0)
    if row.outcome in ENDED:
        for doubt in row.doubts:
            draw_doubt(box, context, doubt.kind, doubt.sentence)
        box.operator("smokelift.open_log", icon="TEXT").take = row.take
    else:
        box.operator("smokelift.cancel", text="Cancel", icon="CANCEL").take = row.take


register, unregister = bpy.utils.register_classes_factory(
    (SMOKELIFT_OT_run, SMOKELIFT_OT_vary, SMOKELIFT_OT_resume, SMOKELIFT_OT_cancel)
)
