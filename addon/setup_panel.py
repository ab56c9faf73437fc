"""The sub-panel Shot Set-Up: what Set Up Shot sets up, each with a tick of its own."""

import bpy

from .smoke import active_smoke
from .subpanel import OfClip

TICKS = ("set_up_range", "set_up_camera", "set_up_light", "set_up_colors", "set_up_plate")
"""Names of the settings."""


class _SetUp(OfClip):
    bl_label = "Shot Set-Up"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_decorate = False
        settings = active_smoke(context.scene).smokelift
        column = layout.column()
        for name in TICKS:
            column.prop(settings, name)
        row = column.row()
        row.use_property_split = True
        row.active = settings.set_up_plate
        row.prop(settings, "plate_place")
        layout.operator("smokelift.set_up", icon="CAMERA_DATA")


class SMOKELIFT_PT_view_set_up(_SetUp, bpy.types.Panel):
    """In the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_set_up(_SetUp, bpy.types.Panel):
    """In the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_PT_view_set_up, SMOKELIFT_PT_clip_set_up))
