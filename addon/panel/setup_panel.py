"""The sub-panel Shot Set-Up: what Set Up Shot sets up, each with a tick of its own; and the button for that."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..result import shot_check
from ..scene import shot_setup, volume
from ..scene.smoke import active_smoke
from .layout import OfClip, RequiresClipAndResult

TICKS = ("set_up_range", "set_up_camera", "set_up_light", "set_up_colors", "set_up_plate")
"""Names of the settings."""


class SMOKELIFT_OT_set_up(RequiresClipAndResult, bpy.types.Operator):
    """Make a render from the camera match the clip."""

    bl_idname = "smokelift.set_up"
    bl_description = (
        "Make a Cycles render from the camera match the clip: resolution, frame rate, background, estimated light "
        "and colors, with samples for about a minute in a new file. The old world stays in the file"
    )
    bl_label = "Set Up Shot"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        take = volume.shown_take(smoke)
        index = take.read().index
        if index is None:
            text = rpt_("The files of the smoke in {:s} are missing: make it again.")
            self.report({"ERROR"}, text.format(str(take.directory)))
            return {"CANCELLED"}
        settings = smoke.smokelift
        if settings.set_up_camera and settings.camera_mode == "SCENE" and context.scene.camera is None:
            self.report({"ERROR"}, "The scene has no camera: choose the one that the smoke was made for.")
            return {"CANCELLED"}
        hidden, further = shot_setup.set_up(smoke, take, index)
        if settings.set_up_camera and context.area is not None and context.area.type == "VIEW_3D":
            context.space_data.region_3d.view_perspective = "CAMERA"
        volume.show(smoke, take)  # the frame rate may have changed
        shot_check.check_again(context)
        said = [rpt_("The shot is set up: press F12 for a render that matches the clip.")]
        if hidden:
            said.append(rpt_("The lamp of the new file is hidden: the smoke has the clip's light."))
        if further:
            text = rpt_("Beside the clip's light the smoke has that of {:s}: hide it from renders for a match.")
            said.append(text.format(", ".join(further)))
        self.report({"INFO"}, " ".join(said))
        return {"FINISHED"}


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
    """The panel in the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_set_up(_SetUp, bpy.types.Panel):
    """The panel in the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


register, unregister = bpy.utils.register_classes_factory(
    (SMOKELIFT_OT_set_up, SMOKELIFT_PT_view_set_up, SMOKELIFT_PT_clip_set_up)
)
