"""The sub-panel Element: the smoke of the clip with alpha, laid over another picture without being made a volume.

The engine writes it as OpenEXR, premultiplied and linear. The strokes that help to tell smoke from background are
painted in the Image Editor, whose sidebar has their colors.
"""

from pathlib import Path

import bpy

from ..core import ShotError
from ..core.take import Take
from ..result import smoke_takes
from ..result.side_job import write_files
from ..scene.blender import rpt_
from ..scene.clip import lay_below, number_in_file, saved_strokes, shown_frame, strokes_at
from ..scene.pictures import write_pictures
from ..scene.plate import camera_of_view, element_behind, show_element_behind
from ..scene.scene_file import footage_tables
from ..scene.smoke import active_smoke, scene_of
from .common import FOLDER, UNDO, OpensBrowser, needs_clip, needs_rest, operator, panels
from .editors import look_through_camera, show_image
from .layout import draw_text, draw_work
from .settings import choice

STROKES_FILE = "strokes.png"  # name of the image in the folder of the smoke's results
COLORS = {"SMOKE": (0.0, 1.0, 0.0), "NOT_SMOKE": (1.0, 0.0, 0.0), "BEHIND": (0.0, 0.0, 1.0)}  # the engine's
PICTURES = "element_####.exr"  # names of the pictures, numbered as the frames of the clip's file


@operator("Paint Strokes", needs_clip, bl_options=UNDO)
def paint_strokes(context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Paint on this frame of the clip where smoke is, where none is, and where the background is seen"""
    now, settings = context.scene.frame_current, smoke.smokelift
    try:
        shown_frame(smoke)
        if settings.strokes is None:
            settings.strokes = strokes_at(smoke_takes.output_folder(smoke) / STROKES_FILE, settings.clip.size)
        saved_strokes(settings.strokes, settings.clip)
        picture = write_pictures(settings.clip, now, now, Path(bpy.app.tempdir) / "smokelift_frame_")
        lay_below(settings.strokes, picture)
    except (RuntimeError, OSError) as error:
        raise ShotError(str(error)) from error
    show_image(settings.strokes, "PAINT")
    _choose_color(context, "SMOKE")


MEANS = choice("Means")(
    "What is painted",
    ("SMOKE", "Smoke", "There is smoke here", "COLORSET_03_VEC", 0),
    ("NOT_SMOKE", "Not Smoke", "There is no smoke here, whatever moves", "COLORSET_01_VEC", 1),
    ("BEHIND", "Behind", "The background is seen here as it is", "COLORSET_04_VEC", 2),
)


@operator("Stroke", given={"means": MEANS}, bl_options={"INTERNAL"})
def stroke(context: bpy.types.Context, _smoke: bpy.types.Object | None, means: str) -> None:
    """Paint in the color that says this. With Ctrl, strokes are erased"""
    _choose_color(context, means)


def _choose_color(context: bpy.types.Context, means: str) -> None:
    paint = context.tool_settings.image_paint
    # since 5.0 each mode of painting has its own
    unified = getattr(paint, "unified_paint_settings", None) or context.tool_settings.unified_paint_settings
    unified.use_unified_color, unified.color, unified.secondary_color = True, COLORS[means], (0.0, 0.0, 0.0)


class SMOKELIFT_PT_strokes(bpy.types.Panel):
    bl_label = "Smoke Strokes"
    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Smokelift"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        shown = context.space_data.image
        return smoke is not None and shown is not None and shown == smoke.smokelift.strokes

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        if context.tool_settings.image_paint.brush is None:
            text = "This Blender comes without brushes: paint the strokes in another, and open that picture as Strokes."
            draw_text(layout, text, "ERROR")
        layout.column(align=True).operator_enum("smokelift.stroke", "means")
        layout.operator("smokelift.paint_strokes", text="Show This Frame", icon="FILE_REFRESH")


def _extract_request(smoke: bpy.types.Object, folder: Path) -> list[str]:
    """The engine's arguments for the element of all used frames; ShotError if the folder cannot be written to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ShotError(f"{folder} cannot be written to ({error.strerror}): choose another folder.") from error
    take = Take(Path(bpy.app.tempdir) / "smokelift_element")
    take.write(footage_tables(smoke), [])
    return ["extract", str(take.scene_file), "--out", str(folder / PICTURES)]


@operator("Extract", needs_rest, needs_clip)
def extract(context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Show the smoke of this frame by itself, with alpha, as Render Element would write it.

    It lies over the background of the view through the scene's camera; without one, it opens in an Image Editor
    """
    area = 0 if context.area is None else context.area.as_pointer()
    folder, frame = smoke_takes.output_folder(smoke) / "element", shown_frame(smoke)
    number = number_in_file(smoke.smokelift.clip, frame)
    picture = folder / PICTURES.replace("####", f"{number:04d}")

    def show(smoke: bpy.types.Object) -> str:  # as it is by now: undo makes it anew
        image = bpy.data.images.load(str(picture), check_existing=True)
        image.reload()
        camera = camera_of_view(scene_of(smoke))
        if camera is None:
            show_image(image)
        else:
            show_element_behind(camera, image)
            look_through_camera(area)
        return rpt_("Frame {:d} of the clip is in {:s}.").format(frame, str(picture))

    words = [*_extract_request(smoke, folder), "--frames", f"{number}:{number}"]
    write_files(smoke, "smokelift.extract", words, show)


@operator("Render Element", needs_rest, needs_clip, base=OpensBrowser, given={"directory": FOLDER})
def render_element(_context: bpy.types.Context, smoke: bpy.types.Object, directory: str) -> None:
    """Write the smoke of all frames by itself, with alpha, as an image sequence (OpenEXR, linear, premultiplied)"""
    said = rpt_("The element is in {:s}.").format(str(Path(directory)))
    write_files(smoke, "smokelift.render_element", _extract_request(smoke, Path(directory)), lambda _smoke: said)


@panels("element", "Element", needs_clip)
def _draw_element(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    layout.use_property_split = False
    row = layout.row(align=True)
    row.template_ID(smoke.smokelift, "strokes", open="image.open", text="Strokes")
    row.operator("smokelift.paint_strokes", text="", icon="BRUSH_DATA")
    draw_work(layout, smoke, "smokelift.extract", "IMAGE_RGB_ALPHA")
    camera = camera_of_view(context.scene)
    if camera is not None and (element := element_behind(camera)) is not None:
        layout.prop(element, "show_background_image", text="Element in View")
    draw_work(layout, smoke, "smokelift.render_element", "RENDER_ANIMATION")
