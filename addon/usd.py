"""What Blender's USD importer leaves out of an export of ours: the material, and the unit of the velocity."""

import importlib.util
import json
from pathlib import Path

import bpy

from .contract import EXPORT_FILE
from .look import fit_look
from .paths import absolute


def complete_import(folder: Path) -> None:
    """Give Volumes that were imported from the USD file of an export what the note beside it says.

    Parameters
    ----------
    folder
        Of the USD file; one without such a note changes nothing.
    """
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


class SMOKELIFT_USD_import(getattr(bpy.types, "USDHook", object)):
    """Completes what is imported."""

    bl_idname = "smokelift.usd_import"
    bl_label = "Smokelift"

    @staticmethod
    def on_import(context: object) -> bool:
        complete_import(Path(context.get_stage().GetRootLayer().realPath).parent)
        return True


def register() -> None:
    """Register the hook, unless USD or its module is missing: without that Blender ends when it calls a hook."""
    if hasattr(bpy.types, "USDHook") and importlib.util.find_spec("pxr") is not None:
        bpy.utils.register_class(SMOKELIFT_USD_import)


def unregister() -> None:
    if getattr(SMOKELIFT_USD_import, "is_registered", False):
        bpy.utils.unregister_class(SMOKELIFT_USD_import)
