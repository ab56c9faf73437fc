"""Hands a smoke on: an export of its files, and assets; and makes the proxy of one that has none.

That changes no result, so it is no run of the queue: a timer of Blender polls the engine.
"""

import json
import time
from pathlib import Path
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import BoolProperty, EnumProperty, PointerProperty, StringProperty

from . import preferences, smoke_takes, volume
from .contract import ASSET_FILE, EXPORT_FILE, FRAME_FILE
from .instances import copy_of, remove_scattered, scatter
from .job import EngineMissingError, Job, engine_command
from .needs import NeedsResult
from .panel import draw_text
from .paths import PATH_OPTIONS, absolute
from .smoke import active_smoke, find_smoke
from .subpanel import OfResult, redraw

TICK_SECONDS = 0.1
REST_SECONDS = 0.4
"""Time without a change of settings before the size is estimated."""

ASSET_TIMES = 8
"""Different times that the instances in the asset have at most, spread over the sequence."""


def _changed(settings: "SmokeliftExport", _context: bpy.types.Context) -> None:
    _session.ask_size(settings.id_data)


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


class _Session:
    """What the engine works on: an export, a proxy, or the estimate of an export; never saved."""

    def __init__(self) -> None:
        self.job: Job | None = None
        self.smoke = 0
        self.size = ""
        self.sentence = ""
        self.operator = ""
        """What writes files, while it does and after that; empty for an estimate."""
        self._asked = 0

    @property
    def working(self) -> bool:
        """Whether files are being written."""
        return self.job is not None and bool(self.operator)

    def ask_size(self, smoke: bpy.types.Object) -> None:
        """Estimate the size of an export once its settings rest. Drawing code may call this."""
        if bpy.app.background or self.working:
            return
        self._asked, self.smoke, self.size = smoke.session_uid, smoke.session_uid, ""
        _again(self._start_size, REST_SECONDS)

    def start(self, smoke: bpy.types.Object, words: list[str], operator: str = "") -> None:
        """Start the engine; EngineMissingError if there is none."""
        self.stop()
        self.smoke, self.operator, self.sentence = smoke.session_uid, operator, ""
        words = [*words, "--progress", "json", *preferences.thread_options()]
        self.job = Job(engine_command(words), Path(bpy.app.tempdir) / "smokelift_export.log")
        self.job.start()
        _again(self.poll, TICK_SECONDS)

    def stop(self) -> None:
        """End the engine at once."""
        if self.job is not None:
            self.job.kill()
        self.job = None

    def poll(self) -> float | None:
        """Read what the engine says; a timer that ends with it."""
        job = self.job
        if job is None:
            return None
        if job.poll():
            redraw(bpy.context.window_manager)
        if not job.ended:
            return TICK_SECONDS
        self.job = None
        done = job.outcome == "done"
        if not self.operator:
            self.size = iface_("About {:s}").format(megabytes(job.details["size"])) if done else job.sentence
            return None
        self.sentence = job.sentence
        smoke = find_smoke(self.smoke)
        if smoke is None or not done:
            return None
        if self.operator == SMOKELIFT_OT_make_proxy.bl_idname:
            volume.show(smoke, volume.shown_take(smoke))
        elif smoke.smokelift_export.host == "blender":
            write_asset(smoke, folder_of(smoke))
        return None

    def _start_size(self) -> None:
        smoke = find_smoke(self._asked)
        if smoke is None or self.working or volume.shown_take(smoke) is None:
            return
        try:
            self.start(smoke, [*arguments(smoke), "--size"])
        except EngineMissingError as error:
            self.size = str(error)


def _again(timer: Any, seconds: float) -> None:
    """Have Blender call a function, once, however often it is asked for."""
    if bpy.app.timers.is_registered(timer):
        bpy.app.timers.unregister(timer)
    bpy.app.timers.register(timer, first_interval=seconds)


_session = _Session()


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
    """Write a .blend beside an export with paths to the files there: the smoke as an asset, and instances of it."""
    copy = copy_of(smoke, smoke.name)
    copy.delta_location = (0.0, 0.0, 0.0)
    copy.data.filepath = str(folder / FRAME_FILE.format(_first(folder)))
    # as it is when the asset is used; nothing of this file but its material goes with it
    copy.location = (0.0, 0.0, 0.0)
    frames = copy.data.frame_duration
    times = min(ASSET_TIMES, frames)
    points = scatter(copy, max(smoke.dimensions.xy), times, frames // times, True)
    try:
        for asset in (copy, points):
            asset.asset_mark()
            asset.asset_data.description = volume.provenance_note(smoke)
        bpy.data.libraries.write(str(folder / ASSET_FILE), {copy, points}, path_remap="RELATIVE_ALL", compress=True)
    finally:
        remove_scattered(points)
        _remove(copy)


def _remove(obj: bpy.types.Object) -> None:
    bpy.data.volumes.remove(obj.data)  # takes the object with it


def _first(folder: Path) -> int:
    """Number of the first frame of an export."""
    return int(json.loads((folder / EXPORT_FILE).read_text(encoding="utf-8"))["frames"][0])


class _Writes(NeedsResult):
    """An operator that has the engine write files of the result on show; without a window it waits for them."""

    def words(self, smoke: bpy.types.Object) -> list[str]:
        """The engine's arguments."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        try:
            _session.start(smoke, self.words(smoke), type(self).bl_idname)
        except EngineMissingError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not bpy.app.background:
            return {"FINISHED"}
        job = _session.job
        while _session.poll() is not None:
            time.sleep(TICK_SECONDS)
        if job.outcome != "done":
            self.report({"ERROR"}, job.sentence)
            return {"CANCELLED"}
        return {"FINISHED"}


class SMOKELIFT_OT_export(_Writes, bpy.types.Operator):
    """Write small OpenVDB files of the smoke, a USD file of them, and for Blender an asset to be used in other files"""

    bl_idname = "smokelift.export"
    bl_label = "Export Smoke"

    def words(self, smoke: bpy.types.Object) -> list[str]:
        return arguments(smoke)


class SMOKELIFT_OT_make_proxy(_Writes, bpy.types.Operator):
    """Write coarse copies of the smoke's files, which viewports show in their place. Renders use the smoke itself"""

    bl_idname = "smokelift.make_proxy"
    bl_label = "Make Proxy"

    def words(self, smoke: bpy.types.Object) -> list[str]:
        return ["proxy", str(volume.shown_take(smoke).directory)]


class SMOKELIFT_OT_cancel_export(bpy.types.Operator):
    """Stop the export"""

    bl_idname = "smokelift.cancel_export"
    bl_label = "Cancel Export"
    bl_options = {"INTERNAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        _session.stop()
        return {"FINISHED"}


def draw_work(
    layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object, operator: str, icon: str
) -> None:
    """The button that has files written; their progress while that is at work, and what it said at its end."""
    own = operator == _session.operator
    if own and _session.working:
        job = _session.job
        text = iface_("{:d} of {:d}").format(job.done, job.total)
        layout.progress(factor=job.done / job.total if job.total else 0.0, text=text, translate=False)
        layout.operator("smokelift.cancel_export", text="Cancel", icon="CANCEL")
    else:
        layout.operator(operator, icon=icon)
    if own and _session.smoke == smoke.session_uid and _session.sentence:
        draw_text(layout, context, _session.sentence, "INFO")


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
        if _session.smoke != smoke.session_uid:
            _session.ask_size(smoke)
        elif _session.size:
            draw_text(layout, context, _session.size, "DISK_DRIVE")
        draw_work(layout, context, smoke, SMOKELIFT_OT_export.bl_idname, "EXPORT")
        layout.operator("smokelift.add_instance", icon="DUPLICATE")
        layout.operator("smokelift.scatter", icon="GEOMETRY_NODES")


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
    SMOKELIFT_OT_cancel_export,
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
    """Unregister them and end the engine."""
    _session.stop()
    for timer in (_session.poll, _session._start_size):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    del bpy.types.Object.smokelift_export
    _unregister()
