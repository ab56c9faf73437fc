"""The buttons that open the strokes for painting and choose their colors, in the Image Editor's sidebar."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty

from . import smoke_takes
from .blender_scene import ShotError
from .clip_pictures import write_pictures
from .clip_table import shown_frame
from .editors import open_tab, show_image
from .needs import NeedsClip
from .paths import relative
from .smoke import active_smoke
from .strokes import lay_below, new_strokes, saved_strokes

FILE = "strokes.png"
"""Name of the image in the folder of the smoke's results."""

COLORS = {"SMOKE": (0.0, 1.0, 0.0), "NOT_SMOKE": (1.0, 0.0, 0.0), "BEHIND": (0.0, 0.0, 1.0)}
"""What the engine takes the colors for."""


class SMOKELIFT_OT_paint_strokes(NeedsClip, bpy.types.Operator):
    """Paint on this frame of the clip where smoke is, where none is, and where the background is seen"""

    bl_idname = "smokelift.paint_strokes"
    bl_label = "Paint Strokes"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke, now = active_smoke(context.scene), context.scene.frame_current
        settings = smoke.smokelift
        try:
            shown_frame(smoke)
            if settings.strokes is None:
                settings.strokes = _strokes(smoke)
            saved_strokes(settings.strokes, settings.clip)
            lay_below(
                settings.strokes, write_pictures(settings.clip, now, now, Path(bpy.app.tempdir) / "smokelift_frame_")
            )
        except (ShotError, RuntimeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not bpy.app.background:
            open_tab(show_image(settings.strokes, "PAINT"))
            _choose_color(context, "SMOKE")
        return {"FINISHED"}


def _strokes(smoke: bpy.types.Object) -> bpy.types.Image:
    """The strokes beside the smoke's results, or new ones there."""
    file = smoke_takes.output_folder(smoke) / FILE
    if file.is_file():
        image = bpy.data.images.load(str(file), check_existing=True)
    else:
        image = new_strokes(file, smoke.smokelift.clip.size)
    image.filepath = relative(file)
    return image


class SMOKELIFT_OT_stroke(bpy.types.Operator):
    """Paint in the color that says this. With Ctrl, strokes are erased"""

    bl_idname = "smokelift.stroke"
    bl_label = "Stroke"
    bl_options = {"INTERNAL"}

    means: EnumProperty(
        name="Means",
        description="What is painted",
        items=[
            ("SMOKE", "Smoke", "There is smoke here", "COLORSET_03_VEC", 0),
            ("NOT_SMOKE", "Not Smoke", "There is no smoke here, whatever moves", "COLORSET_01_VEC", 1),
            ("BEHIND", "Behind", "The background is seen here as it is", "COLORSET_04_VEC", 2),
        ],
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        _choose_color(context, self.means)
        return {"FINISHED"}


def _choose_color(context: bpy.types.Context, means: str) -> None:
    paint = context.tool_settings.image_paint
    # since 5.0 each mode of painting has its own
    unified = getattr(paint, "unified_paint_settings", None) or context.tool_settings.unified_paint_settings
    unified.use_unified_color, unified.color, unified.secondary_color = True, COLORS[means], (0.0, 0.0, 0.0)


class SMOKELIFT_PT_strokes(bpy.types.Panel):
    """The panel."""

    bl_label = "Smoke Strokes"
    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Smokelift"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        shown = context.space_data.image
        return smoke is not None and shown is not None and shown == smoke.smokelift.strokes

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.column(align=True).operator_enum("smokelift.stroke", "means")
        layout.operator("smokelift.paint_strokes", text="Show This Frame", icon="FILE_REFRESH")


register, unregister = bpy.utils.register_classes_factory(
    (SMOKELIFT_OT_paint_strokes, SMOKELIFT_OT_stroke, SMOKELIFT_PT_strokes)
)
