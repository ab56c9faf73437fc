"""Settings of a smoke, saved with its object."""

import bpy
from bpy.props import PointerProperty

from ..scene.blender import PATH_OPTIONS
from .advanced_panel import PlaybackSettings
from .camera_panel import ShotSettings
from .clip_panel import ClipSettings
from .direct_panel import DirectSettings
from .export_panel import ExportSettings
from .quality_panel import QualitySettings
from .settings import link, string, tick
from .setup_panel import SetUpSettings


class SmokeliftDirecting(DirectSettings, bpy.types.PropertyGroup):
    """What is made of the result on show."""


class SmokeliftExport(ExportSettings, bpy.types.PropertyGroup):
    """What is exported of a smoke, on its Volume object."""


class SmokeliftSettings(
    ClipSettings, ShotSettings, QualitySettings, PlaybackSettings, SetUpSettings, bpy.types.PropertyGroup
):
    """Settings of one smoke, on its Volume object."""

    is_smoke: tick("Smoke", "The object is made from a clip", options={"HIDDEN"})
    folder: string("Folder", "Name of the folder for the results", options={"HIDDEN"})
    results: string(
        "Results",
        "Folder that holds the results where none is chosen; the add-on keeps it in step with the .blend",
        options={"HIDDEN"},
    )
    saved_as: string(
        "Saved As",
        "The .blend as it was last saved or opened, which may have been copied or renamed meanwhile",
        options={"HIDDEN"},
    )
    before: string("Before", "The result that was shown before", options={"HIDDEN"})
    directing: link("Direct", "What is made of the result", SmokeliftDirecting)
    output: string(
        "Output",
        "Folder for the results; by default beside the .blend file, or beside the clip if that is unsaved",
        subtype="DIR_PATH",
        options=PATH_OPTIONS,
    )


def register() -> None:
    bpy.types.Object.smokelift = PointerProperty(type=SmokeliftSettings)
    bpy.types.Object.smokelift_export = PointerProperty(type=SmokeliftExport)


def unregister() -> None:
    del bpy.types.Object.smokelift_export
    del bpy.types.Object.smokelift
