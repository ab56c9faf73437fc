"""Presets of a smoke's settings, in the header of the tab, by Blender's own preset system."""

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .smoke import is_smoke

FOLDER = "smokelift"
"""Below the user's folder of presets."""

SETTINGS = (
    "quality",
    "detail",
    "light_mode",
    "closed",
    "longest_side",
    "transfer",
    "speed",
    "device",
    "use_medium",
    "extinction",
    "albedo",
    "anisotropy",
)
"""What does not belong to one clip: no paths, no objects, no frames."""


class SMOKELIFT_PT_presets(PresetPanel, bpy.types.Panel):
    """The menu."""

    bl_label = "Smoke Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "smokelift.add_preset"


class SMOKELIFT_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Keep the settings of the active smoke as a preset, or remove one"""

    bl_idname = "smokelift.add_preset"
    bl_label = "Add Smoke Preset"
    preset_menu = "SMOKELIFT_PT_presets"
    preset_subdir = FOLDER
    # a preset is a script of Blender's, which knows the active object but not this add-on
    preset_defines = ("settings = bpy.context.object.smokelift",)
    preset_values = tuple(f"settings.{name}" for name in SETTINGS)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not is_smoke(context.object):
            cls.poll_message_set("Select the smoke first")
            return False
        return True


def draw_header(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the menu if the smoke is the active object, which presets change."""
    if is_smoke(context.object):
        SMOKELIFT_PT_presets.draw_panel_header(layout)


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_PT_presets, SMOKELIFT_OT_add_preset))
