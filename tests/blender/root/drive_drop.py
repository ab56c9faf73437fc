"""An artist who drags a video from the File Browser into the 3D View. Runs inside Blender, on a file with a shot."""

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from artist import first_window, largest_area, perform, picture, place, region, report, shell, until

PAUSE_SECONDS = 0.7
"""Between the first movements: Blender takes a drag for one only after it has drawn the picture under the mouse."""


def story() -> Iterator[float]:
    """Show a folder with one video, take it by the mouse, let it go above the 3D View, and say what it shall become."""
    window, view, browser = first_window(), largest_area("VIEW_3D"), largest_area("PROPERTIES")
    clip = Path(bpy.data.filepath).with_name("clip.mp4")
    folder = clip.with_name("footage")
    folder.mkdir()
    shutil.copy(clip, folder / "another.mp4")
    browser.type = "FILE_BROWSER"
    space = browser.spaces.active
    space.show_region_toolbar = False
    yield from until(lambda: space.params)
    space.params.directory, space.params.display_type = str(folder).encode(), "THUMBNAIL"
    yield 3.0
    left, top, _, _ = place(window, region(browser, "WINDOW"))
    x, y = left + 60, top + 50  # on the picture of the only file
    yield from press(f"mousemove {x - 4} {y}", f"mousemove {x} {y}", "mousedown 1")
    yield from press(*(f"mousemove {x - way} {y}" for way in (2, 5, 9, 14, 20)))
    left, top, width, height = place(window, region(view, "WINDOW"))
    yield from press(f"mousemove {left + width - 40} {y}", f"mousemove {left + width // 2} {top + height // 2}")
    yield from picture("dragged")
    before = set(window.scene.objects)
    yield from press("mouseup 1")
    yield 1.0
    yield from picture("dropped")  # with the question: Blender can make an Empty of a video too
    yield from press("key s")
    yield from until(lambda: set(window.scene.objects) - before)
    (new,) = set(window.scene.objects) - before
    sidebar = region(view, "UI")
    yield from until(lambda: sidebar.active_panel_category == "Smokelift")
    yield 1.0
    yield from picture("added")
    report["type"], report["is_smoke"], report["clip"] = new.type, new.smokelift.is_smoke, new.smokelift.clip.name
    report["active"] = window.view_layer.objects.active == new


def press(*events: str) -> Iterator[float]:
    """Move the mouse, its button or a key, and give Blender time to see it."""
    for event in events:
        shell(f"xdotool {event}").wait()
        yield PAUSE_SECONDS


perform(story)
