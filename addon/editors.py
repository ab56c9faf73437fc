"""What is read in other editors of Blender: the log of a run, and the page of what was found in the clip."""

import functools
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty

from . import shot_check
from .needs import NeedsClip
from .smoke import active_smoke
from .take import Take

DRAWN_SECONDS = 0.3
"""After which a new window has been drawn."""

LOG_TEXT = "Smokelift Log"


class SMOKELIFT_OT_open_log(bpy.types.Operator):
    """Show the log of the run in a text editor"""

    bl_idname = "smokelift.open_log"
    bl_label = "Open Log"

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        log = Take(Path(self.take)).log_file
        if not log.is_file():
            self.report({"ERROR"}, rpt_("There is no log at {:s}: the engine never started.").format(str(log)))
            return {"CANCELLED"}
        text = bpy.data.texts.get(LOG_TEXT) or bpy.data.texts.new(LOG_TEXT)
        text.from_string(log.read_text(encoding="utf-8", errors="replace"))
        if not bpy.app.background:
            editor = _editor(context, "TEXT_EDITOR")
            editor.text, editor.top = text, 0
        return {"FINISHED"}


class SMOKELIFT_OT_show_page(NeedsClip, bpy.types.Operator):
    """Show on a page all that was found in the clip and assumed: box and light, background, smoke, doubts"""

    bl_idname = "smokelift.show_page"
    bl_label = "Report"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        state = context.window_manager.smokelift
        own = state.check_done and state.check_smoke == active_smoke(context.scene).session_uid
        if not (own and shot_check.page_file().is_file()):
            cls.poll_message_set("Check the shot first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        page = bpy.data.images.load(str(shot_check.page_file()), check_existing=True)
        page.reload()
        if not bpy.app.background:
            _editor(context, "IMAGE_EDITOR").image = page
            bpy.app.timers.register(functools.partial(_fit, page.name), first_interval=DRAWN_SECONDS)
        return {"FINISHED"}


def _fit(name: str) -> None:
    """Show the whole of a picture in the editor that has it; a timer, as a window has no size before it is drawn."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            image = area.spaces.active.image if area.type == "IMAGE_EDITOR" else None
            if image is not None and image.name == name:
                region = next(region for region in area.regions if region.type == "WINDOW")
                with bpy.context.temp_override(window=window, area=area, region=region):
                    bpy.ops.image.view_all(fit_view=True)


def _editor(context: bpy.types.Context, kind: str) -> bpy.types.Space:
    """An editor of a kind, in a window of its own if there is none."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    found = next((area for area in areas if area.type == kind), None)
    if found is None:
        bpy.ops.wm.window_new()
        found = context.window_manager.windows[-1].screen.areas[0]
        found.type = kind
    return found.spaces.active


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_open_log, SMOKELIFT_OT_show_page))
