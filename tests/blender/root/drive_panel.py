"""An artist at the window: opens the tab, presses the button, watches. Runs inside Blender, on a file with a shot.

    blender shot.blend --python drive_panel.py -- FOLDER

Leaves pictures of the whole screen and report.json in FOLDER. Pictures are taken from outside, by xwd: what Blender
says of its own screen is black where OpenGL is software.
"""

import json
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
TICK_SECONDS = 0.02
PATIENCE_SECONDS = 200.0

ENDED = ("done", "failed", "cancelled")

report: dict[str, object] = {}


def story() -> Iterator[float]:
    """What the artist does; yields how long to wait before going on."""
    window = bpy.context.window_manager.windows[0]
    area = max((area for area in window.screen.areas if area.type == "VIEW_3D"), key=lambda area: area.width)
    space = area.spaces.active
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "SOLID"
    space.show_region_ui = True
    yield 1.0
    report["viewport"] = place(window, region(area, "WINDOW"))
    report["view_3d"] = yield from make_smoke(window, area, "view_3d")

    # the same tab beside the clip; nothing is drawn there that takes long in software
    area.type = "CLIP_EDITOR"
    space = area.spaces.active
    space.clip, space.show_region_ui = window.scene.smokelift.clip, True
    yield 1.0
    report["clip_editor"] = yield from make_smoke(window, area, "clip_editor")

    # the scene made to look like the clip, and Cycles in the viewport
    area.type = "VIEW_3D"
    yield 1.0
    yield from find(window, area, region(area, "UI"), "bpy.ops.smokelift.set_up()")
    shell("xdotool mousedown 1; sleep 0.1; xdotool mouseup 1; xdotool mousemove 400 500")
    yield 1.0
    area.spaces.active.shading.type = "RENDERED"
    yield 8.0
    yield from picture("rendered")
    report["volumes"] = sum(thing.type == "VOLUME" for thing in window.scene.objects)


def make_smoke(window: bpy.types.Window, area: bpy.types.Area, name: str) -> Iterator[float]:
    """Open the tab, press the button, watch until the job has ended; returns what was seen."""
    sidebar = region(area, "UI")
    seen = {"sidebar": place(window, sidebar), "progress": []}
    yield from picture(f"{name}_closed")
    sidebar.active_panel_category = "Smokelift"
    area.tag_redraw()
    yield 3.0  # the engine looks at the shot and says what it will take
    yield from picture(f"{name}_idle")
    yield from find(window, area, sidebar, "bpy.ops.smokelift.run()")

    drawn, ticks = [], []
    show = getattr(bpy.types, type(area.spaces.active).__name__)
    handler = show.draw_handler_add(note_smoke, (window.scene, drawn), "WINDOW", "POST_PIXEL")

    def tick() -> float:
        ticks.append(time.monotonic())
        return TICK_SECONDS

    bpy.app.timers.register(tick)
    clicked = time.monotonic()
    shell("xdotool mousedown 1; sleep 0.1; xdotool mouseup 1")
    jobs = bpy.context.window_manager.smokelift.jobs
    earlier = {job.take for job in jobs}
    while not (job := next((job for job in jobs if job.take not in earlier), None)) or job.outcome not in ENDED:
        if time.monotonic() > clicked + PATIENCE_SECONDS:
            raise TimeoutError("the job does not end")
        if job and seen["progress"][-1:] != [job.done]:
            seen["progress"].append(job.done)
            if job.total and job.done == job.total // 2:
                shell(take(f"{name}_running"))
        yield 0.05
    seen["seconds"] = round(time.monotonic() - clicked, 2)
    bpy.app.timers.unregister(tick)
    show.draw_handler_remove(handler, "WINDOW")
    seen["progress"].append(job.done)
    seen["outcome"], seen["sentence"] = job.outcome, job.sentence
    seen["seconds_to_first_drawing"] = round(drawn[0] - clicked, 2) if drawn else None
    seen["longest_gaps"] = [round(gap, 3) for gap in sorted(after - before for before, after in pairwise(ticks))[-5:]]
    shell("xdotool mousemove 400 500")  # where nothing is, lest a tooltip be in the picture
    yield 1.5
    yield from picture(f"{name}_done")
    return seen


def region(area: bpy.types.Area, kind: str) -> bpy.types.Region:
    return next(region for region in area.regions if region.type == kind)


def place(window: bpy.types.Window, region: bpy.types.Region) -> list[int]:
    """Column, row, width and height of a region in a picture of the screen, which counts rows from the top."""
    return [region.x, window.height - region.y - region.height, region.width, region.height]


def find(window: bpy.types.Window, area: bpy.types.Area, region: bpy.types.Region, command: str) -> Iterator[float]:
    """Move the mouse down a region until the button under it is the one that runs a command."""
    manager = bpy.context.window_manager
    x = region.x + region.width // 3
    for y in range(window.height - region.y - region.height + 10, window.height - region.y - 5, 12):
        manager.clipboard = ""
        shell(f"xdotool mousemove {x} {y}")
        yield 0.15
        with bpy.context.temp_override(window=window, area=area, region=region):
            if bpy.ops.ui.copy_python_command_button.poll():
                bpy.ops.ui.copy_python_command_button()
        if manager.clipboard == command:
            return
    raise LookupError(f"no button runs {command}")


def picture(name: str) -> Iterator[float]:
    """Take a picture and wait for it."""
    process = shell(take(name))
    while process.poll() is None:
        yield 0.1


def take(name: str) -> str:
    return f"xwd -root -silent | convert xwd:- {FOLDER}/{name}.png"


def shell(command: str) -> subprocess.Popen:
    """Start a command beside Blender: its events come only while this script rests."""
    return subprocess.Popen(command, shell=True)


def note_smoke(scene: bpy.types.Scene, drawn: list[float]) -> None:
    """Called after an area was drawn: the time of the first that has a Volume to show."""
    if not drawn and any(thing.type == "VOLUME" and thing.data.filepath for thing in scene.objects):
        drawn.append(time.monotonic())


def go_on(steps: Iterator[float]) -> float | None:
    try:
        return next(steps)
    except StopIteration:
        pass
    except Exception:
        report["failure"] = traceback.format_exc()
        shell(take("failure")).wait()
    (FOLDER / "report.json").write_text(json.dumps(report, indent=1))
    bpy.ops.wm.quit_blender()
    return None


bpy.context.preferences.view.show_splash = False
bpy.context.preferences.system.viewport_aa = "OFF"  # else every picture is drawn eight times, in software
steps = story()
bpy.app.timers.register(lambda: go_on(steps), first_interval=1.0)
