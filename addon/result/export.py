"""Hands a smoke on: an export of its files, an asset, a copy at another time, and what an import of USD leaves out.

That is the material, and the unit of the velocity. Blender keeps the time of a sequence in the Volume data-block, so
that a copy at another time has a data-block of its own.
"""

import importlib.util
import json
from pathlib import Path
from typing import Any

import bpy

from ..core import ShotError
from ..core.contract import ASSET_FILE, EXPORT_FILE, FRAME_FILE
from ..core.job import Job
from ..core.sentences import disk_size
from ..scene import volume
from ..scene.blender import absolute, call_later, file_of, iface_, relative
from ..scene.look import fit_look
from ..scene.smoke import find_smoke
from . import smoke_takes
from .side_job import REST_SECONDS, writing_job

_size: dict[tuple[Any, ...], str] = {}
"""The size in words of the next export, by the number of its smoke and what else decides it; never saved."""


def export_size(smoke: bpy.types.Object) -> str:
    """The size in words; empty until the engine has said it, which is asked once. Drawing code may call this."""
    now = (smoke.session_uid, *arguments(smoke), volume.shown_take(smoke).read().frames)
    if now not in _size and not writing_job.writing:
        _size.clear()
        _size[now] = ""
        call_later(_ask_size, REST_SECONDS)
    return _size.get(now, "")


def _ask_size() -> None:
    """Ask the engine once the settings rest."""
    (asked,) = _size
    smoke = find_smoke(asked[0])
    if smoke is None or writing_job.writing or volume.shown_take(smoke) is None:
        return

    def store(_smoke: bpy.types.Object, job: Job) -> None:
        done = job.outcome == "done"
        if asked in _size:  # else the settings have changed meanwhile
            _size[asked] = iface_("About {:s}").format(disk_size(job.details["size"] / 1e6)) if done else job.sentence

    try:
        writing_job.start(smoke, [*arguments(smoke), "--size"], store)
    except ShotError as error:
        _size[asked] = str(error)


def folder_of(smoke: bpy.types.Object) -> Path:
    chosen = smoke.smokelift_export.folder
    return absolute(chosen) if chosen else smoke_takes.output_folder(smoke) / f"export_{smoke.smokelift_export.host}"


def arguments(smoke: bpy.types.Object) -> list[str]:
    """The engine's arguments for the export of the take that a smoke shows."""
    settings, take = smoke.smokelift_export, volume.shown_take(smoke)
    words = ["export", str(take.directory), "--out", str(folder_of(smoke))]
    words += ["--precision", settings.precision, "--proxy", settings.proxy, "--host", settings.host]
    return words if settings.use_velocity else [*words, "--no-velocity"]


def write_asset(smoke: bpy.types.Object, folder: Path) -> None:
    """Write a .blend beside an export with paths to the files there: the smoke as an asset."""
    copy = copy_of(smoke)
    copy.delta_location = (0.0, 0.0, 0.0)
    first = json.loads((folder / EXPORT_FILE).read_text(encoding="utf-8"))["frames"][0]
    copy.data.filepath = str(folder / FRAME_FILE.format(int(first)))
    # as it is when the asset is used; nothing of this file but its material goes with it
    copy.location = (0.0, 0.0, 0.0)
    copy.asset_mark()
    copy.asset_data.description = smoke.data.get(volume.PROVENANCE, "")
    try:
        bpy.data.libraries.write(str(folder / ASSET_FILE), {copy}, path_remap="RELATIVE_ALL", compress=True)
    finally:
        bpy.data.volumes.remove(copy.data)  # takes the object with it


def copy_of(obj: bpy.types.Object, offset: int = 0, repeat: bool = False) -> bpy.types.Object:
    """A copy of a Volume object, no smoke itself, which plays some frames later, and again and again if it repeats."""
    copy = bpy.data.objects.new(obj.name, obj.data.copy())
    copy.delta_location = obj.delta_location  # first: the matrix has it, and gives the rest to the location
    copy.matrix_basis = obj.matrix_basis
    if obj.data.library is not None:
        copy.data.filepath = relative(file_of(obj.data))
    copy.data.frame_start += offset
    if repeat:
        copy.data.sequence_mode = "REPEAT"
    return copy


def complete_import(folder: Path) -> None:
    """Give Volumes that were imported from the USD file of an export what the note beside it says, if there is one."""
    try:
        note = json.loads((folder / EXPORT_FILE).read_text(encoding="utf-8"))
        grids, _ = note["grids"], note["medium"]
    except (OSError, ValueError, LookupError, TypeError):
        return
    for obj in bpy.data.objects:
        if obj.type == "VOLUME" and not obj.data.materials and absolute(obj.data.filepath).parent == folder:
            fit_look(obj, note)
            obj.data.velocity_unit = "SECOND"
            obj.data.velocity_grid = next((name for name in grids if name.startswith("vel")), "velocity")


# without USD's module Blender ends when it calls a hook
if hasattr(bpy.types, "USDHook") and importlib.util.find_spec("pxr") is not None:

    class SMOKELIFT_USD_import(bpy.types.USDHook):
        """Completes what is imported."""

        bl_idname = "smokelift.usd_import"
        bl_label = "Smokelift"

        @staticmethod
        def on_import(context: object) -> bool:
            complete_import(Path(context.get_stage().GetRootLayer().realPath).parent)
            return True
