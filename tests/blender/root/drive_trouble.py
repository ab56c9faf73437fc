"""An artist who does odd things while smoke is made. Runs inside Blender, on a file with a shot.

Every chapter leaves what came of it in the report; the last one closes Blender in the middle of a run.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from artist import first_window, perform, picture, report, runs, shell, until

MODULE = "bl_ext.user_default.smokelift"


def story() -> Iterator[float]:
    for chapter in (undo, rename, delete, save_elsewhere, stop_with_the_keyboard, queue, fail, disable, close):
        yield from chapter()


def scene() -> bpy.types.Scene:
    """Blender's undo replaces it, so it is looked up anew each time."""
    return first_window().scene


def volumes() -> list[bpy.types.Object]:
    return [obj for obj in scene().objects if obj.type == "VOLUME"]


def press(operator: str, *arguments: object, **settings: object) -> None:
    """Run an operator as its button in the first window does."""
    area = max(first_window().screen.areas, key=lambda area: area.width * area.height)
    with bpy.context.temp_override(window=first_window(), area=area):
        family, name = operator.split(".")
        getattr(getattr(bpy.ops, family), name)(*arguments, **settings)


def begin() -> Iterator[float]:
    """Press the button and wait for the first frames."""
    press("smokelift.run")
    yield from until(lambda: runs()[-1].job.done >= 2)


def end() -> Iterator[float]:
    """Wait until everything has ended; returns how."""
    yield from until(lambda: all(run.job.ended for run in runs()))
    yield 0.5
    (obj,) = volumes() or [None]
    return {
        "outcomes": [run.job.outcome for run in runs()],
        "sentence": runs()[-1].job.sentence,
        "volumes": len(volumes()),
        "done": runs()[-1].job.done,
        "frames": obj and obj.data.frame_duration,
        "file": obj and Path(bpy.path.abspath(obj.data.filepath)).is_file(),
    }


def undo() -> Iterator[float]:
    """Undo everything, twice, and redo it."""
    for name in ("Box", "Sun"):
        scene().objects[name].location.z += 0.01
        press("ed.undo_push", message=name)
    yield from begin()
    shell("xdotool mousemove 500 400")
    for key in ("ctrl+z", "ctrl+z", "ctrl+shift+z"):
        yield 0.5
        shell(f"xdotool key {key}")
    report["undo"] = yield from end()


def rename() -> Iterator[float]:
    yield from begin()
    scene().name, volumes()[0].name = "Räuchlein", "煙"
    report["rename"] = yield from end()


def delete() -> Iterator[float]:
    """Delete the smoke; then undo that, and resume."""
    yield from begin()
    for obj in scene().objects:
        obj.select_set(obj == volumes()[0])
    press("object.delete", "EXEC_DEFAULT", True)
    report["deleted"] = yield from end()
    shell("xdotool mousemove 500 400; xdotool key ctrl+z")
    yield from until(volumes)
    press("smokelift.resume")
    report["restored"] = yield from end()


def save_elsewhere() -> Iterator[float]:
    yield from begin()
    other = Path(bpy.data.filepath).parent / "ein anderer Ört"
    other.mkdir()
    press("wm.save_as_mainfile", filepath=str(other / "shot.blend"))
    report["save_elsewhere"] = yield from end()


def stop_with_the_keyboard() -> Iterator[float]:
    """Esc, and yes; then go on."""
    yield from begin()
    shell("xdotool mousemove 500 400; sleep 0.2; xdotool key Escape; sleep 0.8; xdotool key Return")
    report["stopped"] = yield from end()
    press("smokelift.resume")
    report["resumed"] = yield from end()


def queue() -> Iterator[float]:
    """Two runs, of which the second is stopped before it begins, and a third."""
    press("smokelift.run")
    press("smokelift.run")
    press("smokelift.run")
    yield 0.5
    press("smokelift.cancel", take=str(runs()[1].take.directory))
    report["queue"] = yield from end()


def logs() -> list[bpy.types.Area]:
    """Text editors that show something."""
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    return [area for area in areas if area.type == "TEXT_EDITOR" and area.spaces.active.text]


def fail() -> Iterator[float]:
    """The clip's file is replaced by something else: nothing opens over Blender, and a button opens the log."""
    clip = Path(bpy.path.abspath(volumes()[0].smokelift.clip.filepath))
    good = clip.read_bytes()
    clip.write_text("not a video " * 100)
    press("smokelift.run")
    report["failed"] = yield from end()
    yield 1.0
    report["log_opened_by_itself"] = bool(logs())
    yield from picture("failed")
    press("smokelift.open_log", take=str(runs()[-1].take.directory))
    yield 1.0
    report["log"] = logs() and logs()[0].spaces.active.text.as_string()
    clip.write_bytes(good)


def disable() -> Iterator[float]:
    """The add-on is switched off, and on again."""
    yield from begin()
    index = runs()[-1].take.directory / "sequence.json"
    bpy.ops.preferences.addon_disable(module=MODULE)
    before = index.read_bytes()
    clip = next(iter(bpy.data.movieclips))  # what the add-on listened to
    for owner, name in ((clip, "frame_start"), (scene().render, "fps"), (scene().objects["Box"].location, "x")):
        value = getattr(owner, name)
        setattr(owner, name, value + 1)
        yield 0.5
        setattr(owner, name, value)
    yield 1.5
    report["disabled"] = {"known": hasattr(bpy.types.Scene, "smokelift"), "stopped": index.read_bytes() == before}
    bpy.ops.preferences.addon_enable(module=MODULE)
    yield 0.5
    press("smokelift.resume")
    report["enabled"] = yield from end()


def close() -> Iterator[float]:
    yield from begin()
    report["last_take"] = str(runs()[-1].take.directory)


perform(story)
