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

report: dict[str, object] = {}
first_drawn: list[float] = []
ticks: list[float] = []


def story() -> Iterator[float]:
    """What the artist does; yields how long to wait before going on."""
    window = bpy.context.window_manager.windows[0]
    area = max((area for area in window.screen.areas if area.type == "VIEW_3D"), key=lambda area: area.width)
    sidebar = next(region for region in area.regions if region.type == "UI")
    space = area.spaces.active
    scene = window.scene
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "SOLID"
    space.show_region_ui = True
    yield 1.0
    # regions in pixels of the picture, which counts rows from the top
    for name, region in (("sidebar", sidebar), ("viewport", next(r for r in area.regions if r.type == "WINDOW"))):
        report[name] = [region.x, window.height - region.y - region.height, region.width, region.height]
    yield from picture("closed")
    sidebar.active_panel_category = "Smokelift"
    area.tag_redraw()
    yield 3.0  # the engine looks at the shot and says what it will take
    yield from picture("idle")
    report["button"] = yield from find(window, area, sidebar, "bpy.ops.smokelift.run()")

    bpy.types.SpaceView3D.draw_handler_add(note_smoke, (scene,), "WINDOW", "POST_VIEW")
    bpy.app.timers.register(note_tick)
    clicked = time.monotonic()
    shell("xdotool mousedown 1; sleep 0.1; xdotool mouseup 1")
    jobs = bpy.context.window_manager.smokelift.jobs
    seen = []
    while not (jobs and jobs[0].outcome in ("done", "failed", "cancelled")):
        if time.monotonic() > clicked + PATIENCE_SECONDS:
            raise TimeoutError("the job does not end")
        if jobs and (not seen or seen[-1] != jobs[0].done):
            seen.append(jobs[0].done)
        if "running" not in report and jobs and jobs[0].total and jobs[0].done >= jobs[0].total // 2:
            report["running"] = jobs[0].done
            shell(take("running"))
        yield 0.1
    bpy.app.timers.unregister(note_tick)
    report["outcome"], report["sentence"], report["progress"] = jobs[0].outcome, jobs[0].sentence, seen
    report["seconds"] = round(time.monotonic() - clicked, 2)
    report["seconds_to_first_frame"] = round(first_drawn[0] - clicked, 2) if first_drawn else None
    gaps = sorted(after - before for before, after in pairwise(ticks))
    report["longest_gaps"] = [round(gap, 3) for gap in gaps[-5:]]
    shell("xdotool mousemove 400 500")
    yield 1.5
    yield from picture("done")


def find(window: bpy.types.Window, area: bpy.types.Area, region: bpy.types.Region, command: str) -> Iterator[float]:
    """Move the mouse down a region until the button under it is the one that runs a command; returns where it is."""
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
            return [x, y]
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


def note_tick() -> float:
    ticks.append(time.monotonic())
    return TICK_SECONDS


def note_smoke(scene: bpy.types.Scene) -> None:
    """Called after the viewport was drawn."""
    if not first_drawn and any(thing.type == "VOLUME" and thing.data.filepath for thing in scene.objects):
        first_drawn.append(time.monotonic())


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
steps = story()
bpy.app.timers.register(lambda: go_on(steps), first_interval=1.0)
