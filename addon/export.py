"""Hands a smoke on: an export of its files, and assets; and makes the proxy of one that has none."""

import json
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import BoolProperty, EnumProperty, PointerProperty, StringProperty

from . import smoke_takes, volume
from .contract import ASSET_FILE, EXPORT_FILE, FRAME_FILE
from .instances import copy_of
from .job import EngineMissingError, Job
from .needs import NeedsResult
from .panel import draw_text
from .paths import PATH_OPTIONS, absolute
from .side_job import Request, Writes, again, draw_work, side_job
from .smoke import active_smoke, find_smoke
from .subpanel import OfResult

REST_SECONDS = 0.4
"""Time without a change of settings before the size is estimated."""


def _changed(settings: "SmokeliftExport", _context: bpy.types.Context) -> None:
    _estimate.ask(settings.id_data)


class SmokeliftExport(bpy.types.PropertyGroup):
    """What is exported of a smoke, on its object."""

    folder: StringProperty(
        name="Folder",
        description="Folder for the export; by default export_ and the program's name, beside the results",
        subtype="DIR_PATH",
        options=PATH_OPTIONS,
        update=_changed,
    )
    host: EnumProperty(
        name="For",
        description="Program that reads the files",
        items=[
            ("blender", "Blender", "And other programs with Z up: grids density and velocity"),
            ("houdini", "Houdini", "Y up, grids density and vel"),
            ("unreal", "Unreal", "Densities from 0 to 1 for 8 bits, and a pivot that stays in place"),
        ],
        update=_changed,
    )
    precision: EnumProperty(
        name="Precision",
        description="Bits of each value. Smoke too thin to be seen is left out either way",
        items=[
            ("half", "Half", "Floats of 16 bits"),
            ("quantised", "Quantized", "As few bits as a picture of 8 bits needs: half the size"),
        ],
        update=_changed,
    )
    use_velocity: BoolProperty(
        name="Velocity", description="Export the velocity, which motion blur needs", default=True, update=_changed
    )
    proxy: EnumProperty(
        name="Proxy",
        description="Second, coarser sequence for the viewports of those who get the export",
        items=[
            ("1", "None", "No proxy"),
            ("2", "1/2", "Half the resolution, an eighth of the voxels"),
            ("4", "1/4", "A quarter of the resolution"),
        ],
        update=_changed,
    )


class _Estimate:
    """The size of the next export of a smoke; never saved."""

    def __init__(self) -> None:
        self.smoke = 0
        self.size = ""

    def ask(self, smoke: bpy.types.Object) -> None:
        """Estimate the size once the settings rest. Drawing code may call this."""
        if not bpy.app.background and not side_job.writing:
            self.smoke, self.size = smoke.session_uid, ""
            again(self.start, REST_SECONDS)

    def start(self) -> None:
        """Start the engine; a timer that runs once."""
        smoke = find_smoke(self.smoke)
        if smoke is None or side_job.writing or volume.shown_take(smoke) is None:
            return
        try:
            side_job.start(smoke, ([*arguments(smoke), "--size"], self._keep))
        except EngineMissingError as error:
            self.size = str(error)

    def _keep(self, _smoke: bpy.types.Object, job: Job) -> None:
        done = job.outcome == "done"
        self.size = iface_("About {:s}").format(megabytes(job.details["size"])) if done else job.sentence


_estimate = _Estimate()


def folder_of(smoke: bpy.types.Object) -> Path:
    """The folder for the export of a smoke."""
    chosen = smoke.smokelift_export.folder
    return absolute(chosen) if chosen else smoke_takes.output_folder(smoke) / f"export_{smoke.smokelift_export.host}"


def arguments(smoke: bpy.types.Object) -> list[str]:
    """The engine's arguments for the export of the take that a smoke shows."""
    settings, take = smoke.smokelift_export, volume.shown_take(smoke)
    words = ["export", str(take.directory), "--out", str(folder_of(smoke))]
    words += ["--precision", settings.precision, "--proxy", settings.proxy, "--host", settings.host]
    return words if settings.use_velocity else [*words, "--no-velocity"]


def megabytes(count: float) -> str:
    """An amount of bytes in words."""
    return f"{count / 1e6:.1f} MB" if count < 1e9 else f"{count / 1e9:.1f} GB"


def write_asset(smoke: bpy.types.Object, folder: Path) -> None:
    """Write a .blend beside an export with paths to the files there: the smoke as an asset."""
    copy = copy_of(smoke, smoke.name)
    copy.delta_location = (0.0, 0.0, 0.0)
    copy.data.filepath = str(folder / FRAME_FILE.format(_first(folder)))
    # as it is when the asset is used; nothing of this file but its material goes with it
    copy.location = (0.0, 0.0, 0.0)
    copy.asset_mark()
    copy.asset_data.description = volume.provenance_note(smoke)
    try:
        bpy.data.libraries.write(str(folder / ASSET_FILE), {copy}, path_remap="RELATIVE_ALL", compress=True)
    finally:
        bpy.data.volumes.remove(copy.data)  # takes the object with it


def _first(folder: Path) -> int:
    """Number of the first frame of an export."""
    return int(json.loads((folder / EXPORT_FILE).read_text(encoding="utf-8"))["frames"][0])


class SMOKELIFT_OT_export(Writes, NeedsResult, bpy.types.Operator):
    """Write small OpenVDB files of the smoke, a USD file of them, and for Blender an asset to be used in other files"""

    bl_idname = "smokelift.export"
    bl_label = "Export Smoke"

    def request(self, smoke: bpy.types.Object) -> Request:
        return arguments(smoke), _complete


def _complete(smoke: bpy.types.Object, job: Job) -> None:
    if job.outcome == "done" and smoke.smokelift_export.host == "blender":
        write_asset(smoke, folder_of(smoke))


class SMOKELIFT_OT_make_proxy(Writes, NeedsResult, bpy.types.Operator):
    """Write coarse copies of the smoke's files, which viewports show in their place. Renders use the smoke itself"""

    bl_idname = "smokelift.make_proxy"
    bl_label = "Make Proxy"

    def request(self, smoke: bpy.types.Object) -> Request:
        return ["proxy", str(volume.shown_take(smoke).directory)], _show


def _show(smoke: bpy.types.Object, job: Job) -> None:
    if job.outcome == "done":
        volume.show(smoke, volume.shown_take(smoke))


class _ExportPanel(OfResult):
    bl_label = "Export"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        smoke = active_smoke(context.scene)
        settings = smoke.smokelift_export
        layout.prop(settings, "folder", placeholder=str(folder_of(smoke)))
        for name in ("host", "precision", "use_velocity", "proxy"):
            layout.prop(settings, name)
        if _estimate.smoke != smoke.session_uid:
            _estimate.ask(smoke)
        elif _estimate.size:
            draw_text(layout, context, _estimate.size, "DISK_DRIVE")
        draw_work(layout, context, smoke, SMOKELIFT_OT_export.bl_idname, "EXPORT")
        layout.operator("smokelift.add_instance", icon="DUPLICATE")


class SMOKELIFT_PT_view_export(_ExportPanel, bpy.types.Panel):
    """The panel in the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_export(_ExportPanel, bpy.types.Panel):
    """The panel in the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


_CLASSES = (
    SmokeliftExport,
    SMOKELIFT_OT_export,
    SMOKELIFT_OT_make_proxy,
    SMOKELIFT_PT_view_export,
    SMOKELIFT_PT_clip_export,
)

_register, _unregister = bpy.utils.register_classes_factory(_CLASSES)


def register() -> None:
    """Register the settings, operators and panels."""
    _register()
    bpy.types.Object.smokelift_export = PointerProperty(type=SmokeliftExport)


def unregister() -> None:
    """Unregister them, and the estimate that waits."""
    if bpy.app.timers.is_registered(_estimate.start):
        bpy.app.timers.unregister(_estimate.start)
    del bpy.types.Object.smokelift_export
    _unregister()
