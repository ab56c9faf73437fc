"""The sub-panel Direct: what is made of the result on show, and the button that does it."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.take import TakeError
from ..result import run_queue, smoke_takes
from ..result.directing import MESHES
from ..scene.blender import ShotError
from ..scene.modifiers import CAN_INTERPOLATE
from ..scene.smoke import active_smoke
from .layout import (
    OfResult,
    RequiresClipAndResult,
    RequiresResult,
    draw_automatic,
    draw_closed,
    draw_progress,
    draw_ticked,
)

EFFECTORS = "Effectors"
"""Name of a collection that the tab makes."""


class SMOKELIFT_OT_direct(RequiresClipAndResult, bpy.types.Operator):
    """Make a new result of the one on show: longer, at another speed, or repeating. The one on show stays"""

    bl_idname = "smokelift.direct"
    bl_label = "Direct Smoke"
    bl_options = {"UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        try:
            take = smoke_takes.write_directed(smoke)
        except (ShotError, TakeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        run_queue.enqueue(context, smoke, take)
        return {"FINISHED"}


class SMOKELIFT_OT_add_effectors(RequiresResult, bpy.types.Operator):
    """Let the selected objects act on the smoke: put them into the collection of effectors, which is made if need be"""

    bl_idname = "smokelift.add_effectors"
    bl_label = "Add Selected to Effectors"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if not _may_act(context):
            cls.poll_message_set("Select a mesh, a Wind or Turbulence force field, or an Empty")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = active_smoke(context.scene).smokelift.directing
        if settings.effectors is None:
            settings.effectors = bpy.data.collections.new(EFFECTORS)
            context.scene.collection.children.link(settings.effectors)
        for obj in _may_act(context):
            if obj.name not in settings.effectors.objects:
                settings.effectors.objects.link(obj)
        return {"FINISHED"}


def _may_act(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected objects that may act on the active smoke."""
    box = active_smoke(context.scene).smokelift.box
    return [obj for obj in context.selected_objects if obj != box and obj.type in {*MESHES, "EMPTY"}]


class _Direct(OfResult):
    bl_label = "Direct"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        smoke = active_smoke(context.scene)
        settings = smoke.smokelift.directing
        row = layout.row()
        row.use_property_split = False
        row.prop(settings, "direction", expand=True)
        _DIRECTIONS[settings.direction](layout, settings)
        label = settings.bl_rna.properties["direction"].enum_items[settings.direction].name
        row = layout.row()
        row.scale_y = 1.5
        text = iface_("{:s} Smoke").format(iface_(label))
        row.operator("smokelift.direct", text=text, translate=False, icon="PLAY")
        for job in context.window_manager.smokelift.jobs:
            if job.outcome == "running" and job.smoke_uid == smoke.session_uid:
                draw_progress(layout, job)


def _draw_continue(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    layout.prop(settings, "frames")
    layout.prop(settings, "fade")
    draw_ticked(layout, settings, "use_start", "start")
    draw_automatic(layout, settings, "buoyancy")
    draw_automatic(layout, settings, "dissipation")
    layout.prop(settings, "room")
    draw_closed(layout, settings)
    layout.prop(settings, "effectors")
    layout.operator("smokelift.add_effectors", icon="ADD")
    row = layout.row()
    row.active = settings.effectors is not None
    row.prop(settings, "fan_speed")


def _draw_retime(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    layout.prop(settings, "speed")
    layout.prop(settings, "use_ramp")
    column = layout.column()
    column.active = settings.use_ramp
    column.prop(settings, "speed_middle")
    column.prop(settings, "speed_end")
    layout.prop(settings, "live")
    if CAN_INTERPOLATE:
        row = layout.row()
        row.active = settings.live
        row.prop(settings.id_data.smokelift, "between")


def _draw_loop(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    draw_ticked(layout, settings, "use_part", "part_first", "part_last")
    draw_automatic(layout, settings, "overlap")


_DIRECTIONS = {"continue": _draw_continue, "retime": _draw_retime, "loop": _draw_loop}


class SMOKELIFT_PT_view_direct(_Direct, bpy.types.Panel):
    """The panel in the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_direct(_Direct, bpy.types.Panel):
    """The panel in the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


register, unregister = bpy.utils.register_classes_factory(
    (SMOKELIFT_OT_direct, SMOKELIFT_OT_add_effectors, SMOKELIFT_PT_view_direct, SMOKELIFT_PT_clip_direct)
)
