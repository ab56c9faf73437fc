"""An artist at the window: opens the tab, presses the button, watches. Runs inside Blender, on a file with a shot."""

import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
import artist
from artist import click, find, look_away, picture, place, region, report, runs, shell, until

TICK_SECONDS = 0.02
DRAWINGS = 5
EYEDROPPER = 0.85
"""Where the button is in the width of the sidebar."""

BASE = Vector((-0.2, 0.4, 0.0))
"""On the floor of the box, 7.4 m from the camera."""

ALONE = ("bl_space_type", "bl_region_type", "bl_category", "bl_label", "needs", "draw")
"""What a sub-panel has beside its parent."""

SUB_PANELS = ("results", "advanced", "look", "set_up", "direct", "export")


def story() -> Iterator[float]:
    window, area = artist.first_window(), artist.largest_area("VIEW_3D")
    space = area.spaces.active
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "SOLID"
    space.show_region_ui = True
    yield 1.0
    report["viewport"] = place(window, region(area, "WINDOW"))
    yield from qualities(window, area)
    report["view_3d"] = yield from make_smoke(window, area, "view_3d", "bpy.ops.smokelift.run()")

    # another variation, in the same tab beside the clip; nothing is drawn there that takes long in software
    area.type = "CLIP_EDITOR"
    space = area.spaces.active
    space.clip, space.show_region_ui = volume(window).smokelift.clip, True
    yield 1.0
    report["clip_editor"] = yield from make_smoke(window, area, "clip_editor", "bpy.ops.smokelift.vary()")
    report["variation"] = volume(window).smokelift.seed

    # the clip moved in time: Blender tells the add-on
    start, clip = volume(window).data.frame_start, volume(window).smokelift.clip
    clip.frame_start += 5
    yield 1.0
    report["moved_with_the_clip"] = volume(window).data.frame_start - start
    clip.frame_start -= 5
    yield 1.0

    # the scene made to look like the clip, and Cycles in the viewport
    area.type = "VIEW_3D"
    area.spaces.active.region_3d.view_perspective = "PERSP"
    yield 1.0
    yield from find(window, area, region(area, "UI"), "bpy.ops.smokelift.set_up()")
    click()
    yield 1.0
    look_away()
    report["looks_through"] = area.spaces.active.region_3d.view_perspective
    area.spaces.active.shading.type = "RENDERED"
    yield 8.0
    yield from picture("rendered")
    area.spaces.active.shading.type = "SOLID"
    report["distance"] = yield from stands(window, area)
    yield from sub_panels(window, area)
    report["volumes"] = sum(obj.type == "VOLUME" for obj in window.scene.objects)


def qualities(window: bpy.types.Window, area: bpy.types.Area) -> Iterator[float]:
    """Take a picture of the tab with what each quality takes and loses, where the resolution is automatic."""
    settings = volume(window).smokelift
    chosen, settings.longest_side = settings.longest_side, 0
    region(area, "UI").active_panel_category = "Smokelift"
    area.tag_redraw()
    yield from until(artist.checked)
    yield 1.0
    yield from picture("qualities")
    settings.longest_side = chosen
    region(area, "UI").active_panel_category = "View"
    area.tag_redraw()
    yield 1.0


def stands(window: bpy.types.Window, area: bpy.types.Area) -> Iterator[float]:
    """Click on the floor in the picture, from a view that is not the camera's; returns the distance that this gives."""
    settings = volume(window).smokelift
    area.spaces.active.region_3d.view_perspective = "PERSP"
    yield from find(window, area, region(area, "UI"), "bpy.ops.smokelift.place()", EYEDROPPER)
    click()
    yield 1.0
    view = region(area, "WINDOW")
    x, y = location_3d_to_region_2d(view, area.spaces.active.region_3d, BASE)
    shell(f"xdotool mousemove {view.x + round(x)} {window.height - view.y - round(y)}").wait()
    yield 1.0
    yield from picture("eyedropper")
    click()
    yield 1.0
    known, settings.distance = settings.distance, 0.0
    yield from until(artist.checked)
    return known


def sub_panels(window: bpy.types.Window, area: bpy.types.Area) -> Iterator[float]:
    """Take a picture of each sub-panel by itself, open, below the tab's own closed panel."""
    left, top, _, _ = place(window, region(area, "UI"))
    shell(f"xdotool mousemove {left + 60} {top + 14}").wait()
    yield 0.5
    click()
    yield 1.0
    for name in SUB_PANELS:
        of_smoke = getattr(bpy.types, f"SMOKELIFT_PT_view_{name}")
        own = {key: getattr(of_smoke, key) for key in ALONE}
        alone = type(f"SMOKELIFT_PT_alone_{name}", of_smoke.__bases__, own)
        bpy.utils.register_class(alone)
        look_away()
        yield 1.5
        yield from picture(f"sub_panel_{name}")
        bpy.utils.unregister_class(alone)


def volume(window: bpy.types.Window) -> bpy.types.Object:
    return next(obj for obj in window.scene.objects if obj.type == "VOLUME")


def make_smoke(window: bpy.types.Window, area: bpy.types.Area, name: str, command: str) -> Iterator[float]:
    """Open the tab, press the button that runs a command, watch until the job has ended; returns what was seen."""
    sidebar = region(area, "UI")
    seen = {"sidebar": place(window, sidebar), "progress": [], "playhead": [window.scene.frame_current]}
    yield from picture(f"{name}_closed")
    sidebar.active_panel_category = "Smokelift"
    area.tag_redraw()
    yield from until(artist.checked)  # the engine looks at the shot and says what it will take
    yield 1.0
    yield from picture(f"{name}_idle")
    yield from find(window, area, sidebar, command)

    drawn, ticks = [], []
    show = getattr(bpy.types, type(area.spaces.active).__name__)
    handler = show.draw_handler_add(note_smoke, (window.scene, drawn), "WINDOW", "POST_PIXEL")

    def tick() -> float:
        ticks.append(time.monotonic())
        return TICK_SECONDS

    bpy.app.timers.register(tick)
    earlier = list(runs())
    clicked = time.monotonic()
    click()
    yield from until(lambda: runs()[-1:] != earlier[-1:])
    job = runs()[-1].job
    half_way = None
    while not job.ended:
        if seen["progress"][-1:] != [job.done]:
            seen["progress"].append(job.done)
            seen["playhead"].append(window.scene.frame_current)
            if not half_way and job.done >= job.total // 2 > 0:
                half_way = shell(artist.take(f"{name}_running"))
        yield 0.05
    seen["seconds"] = round(time.monotonic() - clicked, 2)
    bpy.app.timers.unregister(tick)
    show.draw_handler_remove(handler, "WINDOW")
    seen["progress"].append(job.done)
    seen["outcome"], seen["sentence"] = job.outcome, job.sentence
    seen["seconds_to_first_drawing"] = round(drawn[0] - clicked, 2) if drawn else None
    seen["longest_gaps"] = [round(gap, 3) for gap in sorted(after - before for before, after in pairwise(ticks))[-5:]]
    look_away()
    yield 1.5
    yield from picture(f"{name}_done")
    seen["seconds_of_a_drawing"] = round(drawing_alone(window), 3)
    return seen


def drawing_alone(window: bpy.types.Window) -> float:
    """How long the whole window takes to draw (s) while no engine runs: in software, much of a gap is that."""
    began = time.monotonic()
    with bpy.context.temp_override(window=window):
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=DRAWINGS)
    return (time.monotonic() - began) / DRAWINGS


def note_smoke(scene: bpy.types.Scene, drawn: list[float]) -> None:
    """Called after an area was drawn: the time of the first that has a Volume to show."""
    if not drawn and any(obj.type == "VOLUME" and obj.data.filepath.endswith(".vdb") for obj in scene.objects):
        drawn.append(time.monotonic())


artist.perform(story)
