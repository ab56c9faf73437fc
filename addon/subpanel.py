"""What the parts of the tab have in common: where they stand, and when they are shown."""

from __future__ import annotations

import bpy

from . import volume
from .smoke import active_smoke


class OfClip:
    """A part that is shown for a smoke with a clip."""

    bl_category = "Smokelift"
    bl_region_type = "UI"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        return smoke is not None and smoke.smokelift.clip is not None


class OfResult(OfClip):
    """A part that is shown for a smoke with a result."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        return smoke is not None and volume.shown_take(smoke) is not None


def redraw(manager: bpy.types.WindowManager) -> None:
    """Redraw every area that shows the panel."""
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "CLIP_EDITOR"):
                area.tag_redraw()
