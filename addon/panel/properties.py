"""What Blender keeps: the settings of a smoke with its object, a user's preferences and presets, and dropped videos."""

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel
from bpy.props import PointerProperty

from ..core import ShotError
from ..core.contract import MAX_START_NUMBER, QUALITIES
from ..scene.blender import PACKAGE, PATH_OPTIONS
from ..scene.smoke import is_smoke
from .camera_panel import ShotSettings
from .clip_panel import ClipSettings
from .common import Need, Needing, operator
from .direct_panel import DirectSettings, ExportSettings
from .layout import draw_automatic, draw_settings
from .look_panel import PlaybackSettings, SetUpSettings
from .quality_panel import QualitySettings
from .settings import automatic_unless, choice, link, string, tick, whole

MANUAL = Path(__file__).parents[1] / "manual" / "index.html"  # the manual, which the extension brings along
FOLDER = "smokelift"  # below the user's folder of presets

SETTINGS = (
    *("quality", "detail", "light_mode", "closed", "longest_side", "transfer", "speed", "device", "start_number"),
    *("use_medium", "extinction", "albedo", "anisotropy"),
)
"""What does not belong to one clip: no paths, no objects, no frames."""


class SmokeliftDirecting(DirectSettings, bpy.types.PropertyGroup):
    """What is made of the result on show."""


class SmokeliftExport(ExportSettings, bpy.types.PropertyGroup):
    """What is exported of a smoke, on its Volume object."""


class SmokeliftSettings(
    ClipSettings, ShotSettings, QualitySettings, PlaybackSettings, SetUpSettings, bpy.types.PropertyGroup
):
    """Settings of one smoke, on its Volume object."""

    is_smoke: tick("Smoke", options={"HIDDEN"})("The object is made from a clip")
    folder: string("Folder", options={"HIDDEN"})("Name of the folder for the results")
    results: string("Results", options={"HIDDEN"})(
        "Folder that holds the results where none is chosen; the add-on keeps it in step with the .blend"
    )
    saved_as: string("Saved As", options={"HIDDEN"})(
        "The .blend as it was last saved or opened, which may have been copied or renamed meanwhile"
    )
    before: string("Before", options={"HIDDEN"})("The result that was shown before")
    directing: link("Direct", SmokeliftDirecting)("What is made of the result")
    output: string("Output", subtype="DIR_PATH", options=PATH_OPTIONS)(
        "Folder for the results; by default beside the .blend file, or beside the clip if that is unsaved"
    )
    start_number: whole("Start Number", default=1, min=0, max=MAX_START_NUMBER)(
        "Number in the name of a result's first file, 1001 for example. The frames themselves count from 1"
    )


class SmokeliftPreferences(bpy.types.AddonPreferences):
    """The preferences and their page."""

    bl_idname = PACKAGE

    output: string("Output", subtype="DIR_PATH")(
        "Folder in which every smoke gets one for its results; by default that is beside the .blend file"
    )
    quality: choice("Quality", default="balanced")(
        "Quality of new smokes", *[(name, name.capitalize(), "") for name in QUALITIES]
    )
    threads: whole("Threads", min=0, soft_max=64, max=1024)(
        "Processor threads that make smoke; automatic is all, fewer leave some for Blender"
    )
    use_threads: automatic_unless("threads", "Threads", 1)

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        draw_settings(layout, self, "output", "quality")
        draw_automatic(layout, self, "threads")
        layout.operator("smokelift.open_manual", icon="HELP")


@operator("Manual")
def open_manual(_context: bpy.types.Context, _smoke: bpy.types.Object | None) -> None:
    """Open the manual in the browser; it is a part of the extension and needs no network"""
    if not MANUAL.is_file():
        raise ShotError("This copy of the add-on has no manual: read docs/blender.md of the source code.")
    bpy.ops.wm.url_open(url=MANUAL.as_uri())


class SMOKELIFT_PT_presets(PresetPanel, bpy.types.Panel):
    """Settings that are kept for other smokes: quality, light, medium, speed and device"""

    bl_label = "Smoke Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "smokelift.add_preset"


class SMOKELIFT_OT_add_preset(Needing, AddPresetBase, bpy.types.Operator):
    """Keep the settings of the active smoke as a preset, or remove one"""

    bl_label = "Add Smoke Preset"
    needs = (Need("Select the smoke first", lambda context, _: is_smoke(context.object)),)
    preset_menu = "SMOKELIFT_PT_presets"
    preset_subdir = FOLDER
    # a preset is a script of Blender's, which knows the active object but not this add-on
    preset_defines = ("settings = bpy.context.object.smokelift",)
    preset_values = tuple(f"settings.{name}" for name in SETTINGS)


def draw_header(panel: bpy.types.Panel, context: bpy.types.Context) -> None:
    """Draw the menu in the header of a panel if the smoke is the active object, which presets change."""
    if is_smoke(context.object):
        SMOKELIFT_PT_presets.draw_panel_header(panel.layout)


class SMOKELIFT_FH_video(bpy.types.FileHandler):
    """Blender asks which one is meant, if it can do something else with such a file."""

    bl_idname = "SMOKELIFT_FH_video"
    bl_label = "Smoke from Video"
    bl_import_operator = "smokelift.add"
    bl_file_extensions = ";".join(sorted(bpy.path.extensions_movie))

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type in ("VIEW_3D", "CLIP_EDITOR")


def register() -> None:
    bpy.types.Object.smokelift = PointerProperty(type=SmokeliftSettings)
    bpy.types.Object.smokelift_export = PointerProperty(type=SmokeliftExport)


def unregister() -> None:
    del bpy.types.Object.smokelift_export
    del bpy.types.Object.smokelift
