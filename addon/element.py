"""The element of a clip: its smoke with alpha, which is laid over another picture without being made a volume.

The engine writes it as OpenEXR, premultiplied and linear.
"""

import shutil
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, StringProperty

from .blender_scene import ShotError
from .clip_table import number_in_file, shown_frame
from .editors import show_image
from .job import Job
from .needs import NeedsClip
from .scene_file import footage_tables
from .side_job import Request, Writes, draw_work, side_job
from .smoke import active_smoke
from .subpanel import OfClip
from .take import Take

PICTURES = "element_####.exr"
"""Names of the pictures, numbered as the frames of the clip's file."""

SHOWN = "element.exr"
"""The picture of a single frame that is shown."""


def _request(smoke: bpy.types.Object, folder: Path) -> list[str]:
    """The engine's arguments for the element of all used frames; its scene file lies among Blender's own."""
    take = Take(Path(bpy.app.tempdir) / "smokelift_element")
    take.write(footage_tables(smoke), [])
    return ["extract", str(take.scene_file), "--out", str(folder / PICTURES)]


class SMOKELIFT_OT_extract(Writes, NeedsClip, bpy.types.Operator):
    """Show the smoke of this frame by itself, with alpha, as Render Element would write it"""

    bl_idname = "smokelift.extract"
    bl_label = "Extract"

    def request(self, smoke: bpy.types.Object) -> Request:
        folder, number = _folder(), number_in_file(smoke.smokelift.clip, shown_frame(smoke))
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        return [*_request(smoke, folder), "--frames", f"{number}:{number}"], _show


def _folder() -> Path:
    """Where the picture of a single frame is written."""
    return Path(bpy.app.tempdir) / "smokelift_element"


def _show(_smoke: bpy.types.Object, job: Job) -> None:
    """Show the one picture; always under the same name, so that Blender keeps one of them."""
    if job.outcome != "done":
        return
    (picture,) = _folder().glob(PICTURES.replace("####", "*"))
    image = bpy.data.images.load(str(picture.replace(_folder() / SHOWN)), check_existing=True)
    image.reload()
    if not bpy.app.background:
        show_image(image)


class SMOKELIFT_OT_render_element(Writes, NeedsClip, bpy.types.Operator):
    """Write the smoke of all frames by itself, with alpha, as an image sequence (OpenEXR, linear, premultiplied)"""

    bl_idname = "smokelift.render_element"
    bl_label = "Render Element"

    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def request(self, smoke: bpy.types.Object) -> Request:
        folder = Path(self.directory)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ShotError(f"{folder} cannot be written to ({error.strerror}): choose another folder.") from error

        def say(_smoke: bpy.types.Object, job: Job) -> None:
            if job.outcome == "done":
                side_job.sentence = rpt_("The element is in {:s}.").format(str(folder))

        return _request(smoke, folder), say


class _Element(OfClip):
    bl_label = "Element"

    def draw(self, context: bpy.types.Context) -> None:
        smoke = active_smoke(context.scene)
        row = self.layout.row(align=True)
        row.template_ID(smoke.smokelift, "strokes", open="image.open", text="Strokes")
        row.operator("smokelift.paint_strokes", text="", icon="BRUSH_DATA")
        for operator, icon in (
            ("smokelift.extract", "IMAGE_RGB_ALPHA"),
            ("smokelift.render_element", "RENDER_ANIMATION"),
        ):
            draw_work(self.layout, context, smoke, operator, icon)


class SMOKELIFT_PT_view_element(_Element, bpy.types.Panel):
    """The panel in the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_element(_Element, bpy.types.Panel):
    """The panel in the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


register, unregister = bpy.utils.register_classes_factory(
    (SMOKELIFT_OT_extract, SMOKELIFT_OT_render_element, SMOKELIFT_PT_view_element, SMOKELIFT_PT_clip_element)
)
