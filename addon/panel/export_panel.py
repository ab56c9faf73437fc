"""The sub-panel Export: the settings of an export, and the buttons for that, for a proxy and for a copy in time."""

import bpy

from ..result.export import arguments, copy_of, folder_of, size_estimate, write_asset
from ..result.side_job import write_files, writing_job
from ..scene import volume
from ..scene.blender import PATH_OPTIONS
from ..scene.smoke import activate
from .common import UNDO, Need, choice, needs_rest, needs_result, needs_smoke, operator, panels, string, tick, whole
from .layout import draw_settings, draw_text, draw_work


class ExportSettings:
    """What is exported of a smoke."""

    folder: string("Folder", subtype="DIR_PATH", options=PATH_OPTIONS)(
        "Folder for the export; by default export_ and the program's name, beside the results"
    )
    host: choice("For")(
        "Program that reads the files",
        ("blender", "Blender", "And other programs with Z up: grids density and velocity"),
        ("houdini", "Houdini", "Y up, grids density and vel"),
        ("unreal", "Unreal", "Densities from 0 to 1 for 8 bits, and a pivot that stays in place"),
    )
    precision: choice("Precision")(
        "Bits of each value. Smoke too thin to be seen is left out either way",
        ("half", "Half", "Floats of 16 bits"),
        ("quantized", "Quantized", "As few bits as a picture of 8 bits needs: half the size"),
    )
    use_velocity: tick("Velocity", default=True)("Export the velocity, which motion blur needs")
    proxy: choice("Proxy")(
        "Second, coarser sequence for the viewports of those who get the export",
        ("1", "None", "No proxy"),
        ("2", "1/2", "Half the resolution, an eighth of the voxels"),
        ("4", "1/4", "A quarter of the resolution"),
    )


@operator("Export Smoke", needs_rest, needs_result)
def export(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Write small OpenVDB files of the smoke, a USD file of them, and for Blender an asset to be used in other files"""

    def add_asset(smoke: bpy.types.Object) -> None:
        if smoke.smokelift_export.host == "blender":
            write_asset(smoke, folder_of(smoke))

    write_files(smoke, "smokelift.export", arguments(smoke), add_asset)


@operator("Make Proxy", needs_rest, needs_result)
def make_proxy(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Write coarse copies of the smoke's files, which viewports show in their place. Renders use the smoke itself"""

    def show_proxy(smoke: bpy.types.Object) -> None:
        volume.show(smoke, volume.shown_take(smoke))

    write_files(smoke, "smokelift.make_proxy", ["proxy", str(volume.shown_take(smoke).directory)], show_proxy)


@operator("Stop Writing", needs_smoke, bl_options={"INTERNAL"})
def stop_writing(_context: bpy.types.Context, _smoke: bpy.types.Object) -> None:
    """Stop writing these files"""
    writing_job.stop()


@panels("export", "Export", needs_result)
def _draw_export(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    settings = smoke.smokelift_export
    layout.prop(settings, "folder", placeholder=str(folder_of(smoke)))
    draw_settings(layout, settings, "host", "precision", "use_velocity", "proxy")
    draw_text(layout, size_estimate.size(smoke), "DISK_DRIVE")
    draw_work(layout, smoke, "smokelift.export", "EXPORT")
    layout.operator("smokelift.add_instance", icon="DUPLICATE")


_needs_sequence = Need(
    "Select a Volume that plays a sequence",
    lambda context, _: context.object and context.object.type == "VOLUME" and context.object.data.is_sequence,
)
_needs_no_driver = Need(
    "Set Speed to Frame by Frame first",
    lambda context, _: not (context.object.data.animation_data and context.object.data.animation_data.drivers),
)
IN_TIME = {
    "offset": whole("Time Offset", default=12)("Frames by which the new object plays later; below 0 earlier"),
    "repeat": tick("Repeat")("Play the frames again and again, as for a loop"),
}


@operator("Instance in Time", _needs_sequence, _needs_no_driver, bl_options=UNDO, given=IN_TIME)
def add_instance(context: bpy.types.Context, _smoke: bpy.types.Object | None, offset: int, repeat: bool) -> None:
    """Add another object that plays the active Volume's files later or earlier. The material is shared"""
    instance = copy_of(context.object, offset, repeat)
    context.collection.objects.link(instance)
    activate(instance, context.scene)
