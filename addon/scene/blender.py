"""What all parts ask of Blender: paths, frames, the user's preferences, and values that follow the newest result."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface as iface_  # noqa: F401 - from here for all, as rpt_ is
from bpy.app.translations import pgettext_rpt as rpt_  # noqa: F401

PACKAGE = __package__.rpartition(".")[0]  # the add-on's name, under which Blender keeps its preferences

# Blender 4.5 and later need this option for // as the .blend's folder; older ones do not know it.
PATH_OPTIONS = {"ANIMATABLE"} | ({"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set())
"""Options of properties that hold a path."""

Timer = Callable[[], float | None]  # returns the seconds to its next call; None ends it
TOLERANCE = 1e-5  # difference, relative to the value above 1, that rounding in Blender's 32-bit numbers may make


def file_of(data: bpy.types.ID) -> Path:
    """The absolute path of the file of a clip, an image or a Volume."""
    return absolute(data.filepath, data.library)


def absolute(path: str, library: bpy.types.Library | None = None, folder: Path | None = None) -> Path:
    """The absolute path, without the ``..`` that Blender's relative paths begin with: so it can be compared.

    ``//`` is the folder of the library that the owner of the path is linked from, else that given, else the .blend's.
    """
    found = bpy.path.abspath(path, start=None if folder is None else str(folder), library=library)
    return Path(os.path.abspath(found))  # noqa: PTH100 - resolve() follows links, which Blender keeps


def relative(path: Path, folder: Path | None = None) -> str:
    """The path as Blender keeps it: relative to a .blend's folder, by default the open one's, where that can be."""
    if folder is None and not bpy.data.filepath:
        return str(path)
    try:
        return bpy.path.relpath(str(path), start=None if folder is None else str(folder))
    except ValueError:  # on another drive
        return str(path)


REDRAW_SECONDS = 0.5  # time between two drawings of the tab while something counts in it
_drawn_at = 0.0  # when the tab was drawn last because something counted in it (s)


@contextmanager
def at_frame(scene: bpy.types.Scene, frame: int) -> Iterator[bpy.types.Depsgraph]:
    """The scene evaluated in a frame; restores the current frame afterwards."""
    before, fraction = scene.frame_current, scene.frame_subframe
    if frame != before:
        scene.frame_set(frame)
    try:
        layer = scene.view_layers[0]
        layer.update()
        yield layer.depsgraph
    finally:
        if (scene.frame_current, scene.frame_subframe) != (before, fraction):
            scene.frame_set(before, subframe=fraction)


def frame_rate(scene: bpy.types.Scene) -> float:
    return scene.render.fps / scene.render.fps_base


def preferred(name: str) -> Any:
    """A preference of the user; None where the add-on runs without being installed."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return getattr(addon.preferences, name) if addon is not None else None


def thread_options() -> list[str]:
    """Options of the engine that limit its threads; they change no result."""
    threads = preferred("threads")
    return ["--threads", str(threads)] if threads else []


def set_unless_changed(
    owner: bpy.types.ID, name: str, holder: Any, attribute: str, value: Any, anyway: bool = False
) -> None:
    """Set a value for the first time, or again if it is still as it was set last, or ``anyway``.

    The owner remembers what was set, in its custom property ``smokelift_NAME``. Blender keeps the value, a number,
    a vector or a matrix, in an attribute of the holder.
    """
    key, found = f"smokelift_{name.lower().replace(' ', '_')}", np.ravel(getattr(holder, attribute))
    if not anyway and key in owner:
        last = np.array(owner[key])
        if found.shape != last.shape or not np.all(abs(found - last) <= TOLERANCE * np.maximum(1.0, abs(last))):
            return
    setattr(holder, attribute, value)
    owner[key] = np.ravel(getattr(holder, attribute)).astype(float).tolist()


def call_later(timer: Timer, seconds: float) -> None:
    """Have Blender call a function, once, however often it is asked for."""
    cancel_call(timer)
    bpy.app.timers.register(timer, first_interval=seconds)
    _called_later.add(timer)


def cancel_call(timer: Timer) -> None:
    """Have Blender not call it."""
    if bpy.app.timers.is_registered(timer):
        bpy.app.timers.unregister(timer)


_called_later: set[Timer] = set()  # what Blender was ever asked to call


def register_modules(modules: Sequence[ModuleType]) -> None:
    """Register the classes of modules, their ``HANDLERS``, each after the list or menu that it is for, and more."""
    for module in modules:
        for cls in _classes(module):
            bpy.utils.register_class(cls)
        for handlers, handler in getattr(module, "HANDLERS", ()):
            handlers.append(persistent(handler))
        if hasattr(module, "register"):
            module.register()


def unregister_modules(modules: Sequence[ModuleType]) -> None:
    """Unregister them, and what would be called later."""
    for module in reversed(modules):
        if hasattr(module, "unregister"):
            module.unregister()
        for handlers, handler in getattr(module, "HANDLERS", ()):
            handlers.remove(handler)
        for cls in reversed(_classes(module)):
            bpy.utils.unregister_class(cls)
    for timer in _called_later:
        cancel_call(timer)


def _classes(module: ModuleType) -> list[type]:
    """What Blender has to know of a module: its own classes, and those of a tuple in it, in their order."""
    values = [each for value in vars(module).values() for each in (value if isinstance(value, tuple) else (value,))]
    kinds = ("Operator", "Panel", "PropertyGroup", "AddonPreferences", "FileHandler", "USDHook")
    known = tuple(getattr(bpy.types, kind) for kind in kinds if hasattr(bpy.types, kind))  # some are built without USD
    own = [each for each in values if isinstance(each, type) and each.__module__ == module.__name__]
    return [cls for cls in own if issubclass(cls, known)]


def redraw() -> None:
    """Redraw the tab soon, however often it is asked for: while Blender draws, it takes no click."""
    call_later(_redraw_sidebars, max(0.0, _drawn_at + REDRAW_SECONDS - time.monotonic()))


def _redraw_sidebars() -> None:
    """Redraw every sidebar that shows the tab, and nothing beside it: the view takes long."""
    global _drawn_at
    _drawn_at = time.monotonic()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type in ("VIEW_3D", "CLIP_EDITOR") else ():
                if region.type == "UI":
                    region.tag_redraw()
