"""What a user sets once for all files: Edit > Preferences > Add-ons > Smokelift."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from .automatic import automatic_unless, draw_automatic
from .contract import QUALITIES
from .paths import absolute

MANUAL = Path(__file__).parent / "manual" / "index.html"
"""The manual, which the extension brings along."""


def of_user() -> "SmokeliftPreferences | None":
    """The user's preferences; None where the add-on runs without being installed."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon is not None else None


def output_folder() -> Path | None:
    """Folder in which every smoke has one for its results; None if they lie beside the .blend."""
    user = of_user()
    return absolute(user.output) if user is not None and user.output else None


def quality() -> str | None:
    """Quality of new smokes; None for the usual one."""
    user = of_user()
    return user.quality if user is not None else None


def thread_options() -> list[str]:
    """Options of the engine that limit its threads; they change no result."""
    user = of_user()
    return ["--threads", str(user.threads)] if user is not None and user.threads else []


class SmokeliftPreferences(bpy.types.AddonPreferences):
    """The preferences and their page."""

    bl_idname = __package__

    output: StringProperty(
        name="Output",
        description="Folder in which every smoke gets one for its results; by default that is beside the .blend file",
        subtype="DIR_PATH",
    )
    quality: EnumProperty(
        name="Quality",
        description="Quality of new smokes",
        items=[(name, name.capitalize(), "") for name in QUALITIES],
        default="balanced",
    )
    threads: IntProperty(
        name="Threads",
        description="Processor threads that make smoke; automatic is all, fewer leave some for Blender",
        default=0,
        min=0,
        soft_max=64,
        max=1024,
    )
    use_threads: automatic_unless("threads", "Threads", 1)

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for name in ("output", "quality"):
            layout.prop(self, name)
        draw_automatic(layout, self, "threads")
        layout.operator("smokelift.open_manual", icon="HELP")


class SMOKELIFT_OT_open_manual(bpy.types.Operator):
    """Open the manual in the browser; it is a part of the extension and needs no network"""

    bl_idname = "smokelift.open_manual"
    bl_label = "Manual"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        if not MANUAL.is_file():
            self.report({"ERROR"}, "This copy of the add-on has no manual: read docs/blender.md of the source code.")
            return {"CANCELLED"}
        return bpy.ops.wm.url_open(url=MANUAL.as_uri())


_CLASSES = (SmokeliftPreferences, SMOKELIFT_OT_open_manual)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
