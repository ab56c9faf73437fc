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


def register() -> None:
    bpy.types.Object.smokelift = PointerProperty(type=SmokeliftSettings)
    bpy.types.Object.smokelift_export = PointerProperty(type=SmokeliftExport)


def unregister() -> None:
    del bpy.types.Object.smokelift_export
    del bpy.types.Object.smokelift
