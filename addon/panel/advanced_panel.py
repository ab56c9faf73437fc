"""The sub-panel Advanced: settings that most shots leave as they are, and what was assumed."""

import bpy

from ..scene.modifiers import CAN_INTERPOLATE
from ..scene.smoke import active_smoke
from .layout import OfClip, draw_automatic


class _Advanced(OfClip):
    bl_label = "Advanced"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        smoke = active_smoke(context.scene)
        settings = smoke.smokelift
        row = layout.row()
        row.active = settings.camera_mode == "SCENE"
        draw_automatic(row, settings, "longest_side")
        draw_automatic(layout, settings, "fps")
        for name in ("transfer", "speed"):
            layout.prop(settings, name)
        if CAN_INTERPOLATE:
            layout.prop(settings, "between")
        for name in ("device", "use_medium"):
            layout.prop(settings, name)
        column = layout.column()
        column.active = settings.use_medium
        for name in ("extinction", "albedo", "anisotropy"):
            column.prop(settings, name)
        state = context.window_manager.smokelift
        if state.check_smoke == smoke.session_uid and state.notes:
            for note in state.notes.split("\n"):
                layout.label(text=note, translate=False)
        layout.operator("smokelift.show_page", icon="IMAGE_DATA")
        layout.operator("smokelift.check", icon="VIEWZOOM")


class SMOKELIFT_PT_view_advanced(_Advanced, bpy.types.Panel):
    """The panel in the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_advanced(_Advanced, bpy.types.Panel):
    """The panel in the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_PT_view_advanced, SMOKELIFT_PT_clip_advanced))
