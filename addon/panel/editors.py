"""What is shown in other editors of Blender: the log of a run, pictures, the page of what was found in the clip."""

import functools
import time
from pathlib import Path

import bpy

from ..core import ShotError
from ..core.take import Take
from ..result.shot_check import state
from ..scene.blender import rpt_
from .common import HIDDEN, Need, needs_clip, needs_smoke, operator

DRAWN_SECONDS = 0.3  # after which a new window has been drawn
LONGEST_OPENING = 5.0  # seconds in which a sidebar is drawn for the first time

LOG_TEXT = "Smokelift Log"


@operator("Open Log", needs_smoke, given={"take": HIDDEN})
def open_log(_context: bpy.types.Context, _smoke: bpy.types.Object, take: str) -> None:
    """Show the log of the run in a text editor"""
    log = Take(Path(take)).log_file
    if not log.is_file():
        raise ShotError(rpt_("There is no log at {:s}: the engine never started.").format(str(log)))
    text = bpy.data.texts.get(LOG_TEXT) or bpy.data.texts.new(LOG_TEXT)
    text.from_string(log.read_text(encoding="utf-8", errors="replace"))
    if not bpy.app.background:
        space = _editor("TEXT_EDITOR").spaces.active
        space.text, space.top = text, 0


_needs_page = Need(
    "Check the shot first", lambda _, smoke: state.fits(smoke) and state.done and Path(state.page).is_file()
)


@operator("Report", needs_clip, _needs_page)
def show_page(_context: bpy.types.Context, _smoke: bpy.types.Object) -> None:
    """Show on a page all that was found in the clip and assumed: box and light, background, smoke, doubts"""
    page = bpy.data.images.load(state.page, check_existing=True)
    page.reload()
    show_image(page)


def show_image(image: bpy.types.Image, mode: str = "VIEW") -> None:
    """Show the whole of a picture in an Image Editor in a mode, so that one that is painted and one of the result stay.

    To view, it is over a checker where it is transparent; to paint, it is shown without its alpha, beside the tab.
    Without a window nothing is shown, here and below.
    """
    if bpy.app.background:
        return
    area = _editor("IMAGE_EDITOR", mode)
    space = area.spaces.active
    space.mode, space.image = mode, image
    space.display_channels = "COLOR" if mode == "PAINT" else "COLOR_ALPHA"
    if mode == "PAINT":
        open_tab(area)


def show_clip(clip: bpy.types.MovieClip, mask: bpy.types.Mask | None = None) -> None:
    """Show a clip in a Clip Editor beside the tab, with a mask to be drawn over it, or to be tracked and stabilized."""
    if bpy.app.background:
        return
    area = _editor("CLIP_EDITOR")
    space = area.spaces.active
    space.clip, space.mode = clip, "TRACKING" if mask is None else "MASK"
    if mask is not None:
        space.mask = mask
    open_tab(area)


def look_through_camera(area_pointer: int) -> None:
    """Look through the scene's camera in a 3D View, if it is still there."""
    for _, area in _windows_and_areas():
        if area.as_pointer() == area_pointer and area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "CAMERA"


def _windows_and_areas() -> list[tuple[bpy.types.Window, bpy.types.Area]]:
    return [(window, area) for window in bpy.context.window_manager.windows for area in window.screen.areas]


def _fit(area_pointer: int) -> None:
    """Show the whole of a picture or clip in an editor; a timer, as a window has no size before it is drawn."""
    for window, area in _windows_and_areas():
        view = {"IMAGE_EDITOR": bpy.ops.image, "CLIP_EDITOR": bpy.ops.clip}.get(area.type)
        if area.as_pointer() == area_pointer and view is not None:
            region = next(region for region in area.regions if region.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                view.view_all(fit_view=True)


def _editor(kind: str, mode: str = "") -> bpy.types.Area:
    """An editor of a kind, and of a mode if it has some; in a window of its own if there is none. All is shown soon."""
    manager = bpy.context.window_manager
    areas = (area for _, area in _windows_and_areas() if area.type == kind)
    found = next((area for area in areas if mode in ("", area.spaces.active.mode)), None)
    if found is None:
        with bpy.context.temp_override(window=manager.windows[0]):  # a timer has none
            bpy.ops.wm.window_new()
        found = manager.windows[-1].screen.areas[0]
        found.type = kind
    bpy.app.timers.register(functools.partial(_fit, found.as_pointer()), first_interval=DRAWN_SECONDS)
    return found


def open_tab(area: bpy.types.Area) -> None:
    """Show the tab in the sidebar of an editor."""
    area.spaces.active.show_region_ui = True
    choose = functools.partial(_choose_tab, area.as_pointer(), time.monotonic() + LONGEST_OPENING)
    bpy.app.timers.register(choose)


def _choose_tab(area_pointer: int, end: float) -> float | None:
    """Choose the tab in the sidebar of an area; a timer, as one that was never open has no tabs before it is drawn."""
    area = next((area for _, area in _windows_and_areas() if area.as_pointer() == area_pointer), None)
    if area is None or time.monotonic() > end:
        return None
    sidebar = next(region for region in area.regions if region.type == "UI")
    try:
        sidebar.active_panel_category = "Smokelift"
    except (AttributeError, TypeError):
        return DRAWN_SECONDS
    area.tag_redraw()
    return None
