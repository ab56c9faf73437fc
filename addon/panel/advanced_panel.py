"""The sub-panel Advanced: settings that most shots leave as they are, and what was assumed."""

import bpy

from ..result.shot_check import found_lines, state
from ..scene.modifiers import CAN_INTERPOLATE
from .common import needs_clip, panels, speed_changed
from .layout import draw_automatic, draw_settings
from .settings import choice, tick


class PlaybackSettings:
    """How a result is played."""

    speed: choice("Speed", update=speed_changed)(
        "Speed of the smoke if clip and scene differ in frame rate",
        ("FRAMES", "Frame by Frame", "One frame of the clip in each frame of the scene, as Blender plays clips"),
        ("REAL", "Real Time", "As fast as in reality"),
    )
    between: tick("Frames Between", update=speed_changed)(
        "At another speed than the clip's, compute what lies between two frames with their velocity, while it is "
        "shown and rendered. Blender can do so since 5.0"
    )


@panels("advanced", "Advanced", needs_clip)
def _draw_advanced(layout: bpy.types.UILayout, _context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    settings = smoke.smokelift
    row = layout.row()
    row.active = settings.camera_mode == "SCENE"
    draw_automatic(row, settings, "longest_side")
    draw_automatic(layout, settings, "fps")
    draw_settings(layout, settings, "transfer", "speed", *(["between"] if CAN_INTERPOLATE else []))
    draw_settings(layout, settings, "device", "use_medium")
    draw_settings(layout, settings, "extinction", "albedo", "anisotropy", active=settings.use_medium)
    if state.fits(smoke) and state.done:
        for line in found_lines(state.details.get("facts", ())):
            layout.label(text=line, translate=False)
    layout.operator("smokelift.show_page", icon="IMAGE_DATA")
    layout.operator("smokelift.check", icon="VIEWZOOM")
