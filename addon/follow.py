"""Keeps the paths in smokes' settings when their .blend is saved elsewhere.

Blender does so for the paths of its own data, and not for those that an extension adds.
"""

from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from .paths import absolute, relative

_NAMES = ("output", "results", "before", "plate", "mask")
"""Settings of a smoke that hold a path."""

_OWN = ("results", "before")
"""Paths that the add-on sets: an absolute one becomes relative with the first save."""

_places: list[tuple[bpy.types.PropertyGroup, str, Path]] = []
"""Where the relative paths lead while a file is saved: settings, name and absolute path."""


@persistent
def _before_save(file: str) -> None:
    """Write the relative paths as the new file needs them."""
    _places.clear()
    if not file:  # the startup file
        return
    for obj in bpy.data.objects:
        if obj.library is None and obj.smokelift.is_smoke:
            for name in _NAMES:
                path = getattr(obj.smokelift, name)
                if (bpy.data.filepath and path.startswith("//")) or (path and name in _OWN):
                    _places.append((obj.smokelift, name, absolute(path)))
    for settings, name, place in _places:
        _set(settings, name, relative(place, Path(file).parent))


@persistent
def _after_save(_file: str) -> None:
    """Write them as the open file needs them, which is the old one where a copy was saved."""
    for settings, name, place in _places:
        _set(settings, name, relative(place))
    _places.clear()


def _set(settings: bpy.types.PropertyGroup, name: str, path: str) -> None:
    """Set a path unless it is the same: a new one begins a check of the shot."""
    if getattr(settings, name) != path:
        setattr(settings, name, path)


_HANDLERS = (
    (bpy.app.handlers.save_pre, _before_save),
    (bpy.app.handlers.save_post, _after_save),
    (bpy.app.handlers.save_post_fail, _after_save),
)


def register() -> None:
    for handlers, handler in _HANDLERS:
        handlers.append(handler)


def unregister() -> None:
    for handlers, handler in _HANDLERS:
        handlers.remove(handler)
