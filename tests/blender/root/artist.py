"""What an artist at the window does, for stories that run inside Blender: look, find a button, click, take pictures.

Pictures are of the whole screen and taken from outside, by xwd: what Blender says of its own screen is black where
OpenGL is software. They and report.json are left in the folder that the command line names last.
"""

import faulthandler
import json
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy

FOLDER = Path(sys.argv[-1])
PATIENCE_SECONDS = 400.0
report: dict[str, object] = {}


def perform(story: Callable[[], Iterator[float]]) -> None:
    """Play a story beside Blender's own life: it yields how long to wait before going on. Then Blender quits."""
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.system.viewport_aa = "OFF"  # else every picture is drawn eight times, in software
    faulthandler.enable()  # where a crash of Blender came from
    steps = story()
    bpy.app.timers.register(lambda: _go_on(steps), first_interval=1.0, persistent=True)


def _go_on(steps: Iterator[float]) -> float | None:
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


def first_window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def largest_area(kind: str) -> bpy.types.Area:
    """The widest of a kind in the first window."""
    return max((area for area in first_window().screen.areas if area.type == kind), key=lambda area: area.width)


def of_addon(module: str) -> ModuleType:
    return next(known for name, known in sys.modules.items() if name.endswith(f".smokelift.{module}"))


def runs() -> list[Any]:
    return of_addon("result.smoke_takes").runs


def checked() -> bool:
    return of_addon("result.shot_check").state.done


def until(condition: Callable[[], object]) -> Iterator[float]:
    """Wait until something is so, but not for ever."""
    end = time.monotonic() + PATIENCE_SECONDS
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("it does not come to that")
        yield 0.02


def region(area: bpy.types.Area, kind: str) -> bpy.types.Region:
    return next(region for region in area.regions if region.type == kind)


def place(window: bpy.types.Window, region: bpy.types.Region) -> list[int]:
    """Column, row, width and height of a region in a picture of the screen, which counts rows from the top."""
    return [region.x, window.height - region.y - region.height, region.width, region.height]


def find(
    window: bpy.types.Window, area: bpy.types.Area, region: bpy.types.Region, command: str, across: float = 1 / 3
) -> Iterator[float]:
    """Move the mouse down a region, at a share of its width, until the button under it is the one of a command."""
    manager = bpy.context.window_manager
    x = region.x + round(region.width * across)
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
    process = shell(take(name))
    while process.poll() is None:
        yield 0.1


def take(name: str) -> str:
    return f"xwd -root -silent | convert xwd:- {FOLDER}/{name}.png"


def shell(command: str) -> subprocess.Popen:
    """Start a command beside Blender: its events come only while this script rests."""
    return subprocess.Popen(command, shell=True)


def click() -> None:
    shell("xdotool mousedown 1; sleep 0.1; xdotool mouseup 1")


def look_away() -> None:
    """Move the mouse to where nothing is, lest a tooltip be in a picture."""
    shell("xdotool mousemove 400 500")
