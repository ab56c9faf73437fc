"""Settings of a smoke, saved with its object, and the state of this session, on the window manager."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
    StringProperty,
)

from ..scene.blender import PATH_OPTIONS
from .advanced_panel import PlaybackSettings
from .camera_panel import ShotSettings
from .clip_panel import ClipSettings
from .direct_panel import DirectSettings
from .export_panel import ExportSettings
from .quality_panel import QualitySettings
from .setup_panel import SetUpSettings


class SmokeliftDirecting(DirectSettings, bpy.types.PropertyGroup):
    """What is made of the result on show."""


class SmokeliftExport(ExportSettings, bpy.types.PropertyGroup):
    """What is exported of a smoke, on its Volume object."""


class SmokeliftSettings(
    ClipSettings, ShotSettings, QualitySettings, PlaybackSettings, SetUpSettings, bpy.types.PropertyGroup
):
    """Settings of one smoke, on its Volume object."""

    is_smoke: BoolProperty(name="Smoke", description="The object is made from a clip", options={"HIDDEN"})
    folder: StringProperty(name="Folder", description="Name of the folder for the results", options={"HIDDEN"})
    results: StringProperty(
        name="Results",
        description="Folder that holds the results where none is chosen; the add-on keeps it in step with the .blend",
        options={"HIDDEN"},
    )
    saved_as: StringProperty(
        name="Saved As",
        description="The .blend as it was last saved or opened, which may have been copied or renamed meanwhile",
        options={"HIDDEN"},
    )
    before: StringProperty(name="Before", description="The result that was shown before", options={"HIDDEN"})
    directing: PointerProperty(name="Direct", description="What is made of the result", type=SmokeliftDirecting)
    output: StringProperty(
        name="Output",
        description="Folder for the results; by default beside the .blend file, or beside the clip if that is unsaved",
        subtype="DIR_PATH",
        options=PATH_OPTIONS,
    )


class SmokeliftDoubt(bpy.types.PropertyGroup):
    """Why a result may be nothing, or wrong."""

    kind: StringProperty(description="The engine's name of the sentence; empty if it has none")
    sentence: StringProperty()


class SmokeliftJob(bpy.types.PropertyGroup):
    """One run in the panel."""

    smoke_uid: IntProperty()
    take: StringProperty()
    outcome: StringProperty(default="waiting")
    done: IntProperty()
    total: IntProperty()
    seconds_left: FloatProperty(default=-1.0)
    sentence: StringProperty()
    doubts: CollectionProperty(type=SmokeliftDoubt)
    icon: IntProperty()
    cancel: BoolProperty()
    left: BoolProperty(description="The artist chose another result while it runs")


class SmokeliftCost(bpy.types.PropertyGroup):
    """What a run takes at the quality that it is named after."""

    resolution: IntVectorProperty(size=3)
    seconds: FloatProperty()
    memory: FloatProperty(description="GiB")
    disk: FloatProperty(description="MB")
    lost: FloatProperty(description="Fraction of the smoke's contrast in the clip; below 0 if unknown")


class SmokeliftState(bpy.types.PropertyGroup):
    """This session's runs, and the estimate of the next one; never saved."""

    jobs: CollectionProperty(type=SmokeliftJob)
    check_smoke: IntProperty()
    check_page: StringProperty(description="Picture of what was found in the shot that was checked")
    check_done: BoolProperty()
    check_error: StringProperty()
    notes: StringProperty()
    doubts: CollectionProperty(type=SmokeliftDoubt)
    costs: CollectionProperty(type=SmokeliftCost)
    costs_smoke: IntProperty(description="Whose the costs are")
    memory_free: FloatProperty(description="GiB")


def register() -> None:
    """Give objects their settings, and the session its state."""
    bpy.types.Object.smokelift = PointerProperty(type=SmokeliftSettings)
    bpy.types.Object.smokelift_export = PointerProperty(type=SmokeliftExport)
    bpy.types.WindowManager.smokelift = PointerProperty(type=SmokeliftState)


def unregister() -> None:
    del bpy.types.WindowManager.smokelift
    del bpy.types.Object.smokelift_export
    del bpy.types.Object.smokelift
