"""Keeps what smokes say of files true when their .blend is saved elsewhere, and when that is undone.

Blender does so for the paths of its own data when it saves, and not for those that an extension adds. An undo brings
back relative paths that were meant for an earlier folder, which Blender leaves as they are.
"""

from collections.abc import Iterator
from pathlib import Path

import bpy

from ..core.take import Take
from ..scene.blender import absolute, relative
from ..scene.smoke import volume_objects
from .smoke_takes import find_results_again, takes_of_file

_NAMES = ("output", "results", "before", "plate", "mask")  # settings that hold a path, as the folder of an export does
_OWN = ("results", "before")  # paths that the add-on sets: an absolute one becomes relative with the first save
_DATA = ("volumes", "images", "movieclips", "sounds", "fonts", "cache_files", "libraries")  # Blender's own

_places: list[tuple[bpy.types.PropertyGroup, str, Path]] = []
"""Where the relative paths lead while a file is saved: settings, name and absolute path."""

_takes: list[Take] = []  # what belongs to the file while it is saved
_folders: list[Path] = []  # folders that the open .blend was in before it was saved elsewhere, the last one first


def _smokes() -> Iterator[bpy.types.Object]:
    """The smokes of all scenes, those in none too."""
    return (obj for obj in volume_objects() if obj.library is None and obj.smokelift.is_smoke)


def _settings() -> Iterator[tuple[bpy.types.PropertyGroup, str, str]]:
    """Settings that hold a path, with their names and paths."""
    for obj in _smokes():
        for owner, names in ((obj.smokelift, _NAMES), (obj.smokelift_export, ("folder",))):
            for name in names:
                if path := getattr(owner, name):
                    yield owner, name, path


def _before_save(file: str) -> None:
    """Write the relative paths as the new file needs them."""
    _places.clear()
    _takes.clear()
    if not file:  # the startup file
        return
    _takes.extend(takes_of_file())
    for owner, name, path in _settings():
        if (bpy.data.filepath and path.startswith("//")) or name in _OWN:
            _places.append((owner, name, absolute(path)))
            _set(owner, name, relative(absolute(path), Path(file).parent))
    _set_saved_as(file)
    here = Path(bpy.data.filepath).parent
    if bpy.data.filepath and here not in _folders[:1]:
        _folders.insert(0, here)


def _after_save(file: str) -> None:
    """Write them as the open file needs them, which is the old one where a copy was saved; its takes are the new's."""
    _stay()
    for take in _takes:
        take.note_file(Path(file))
    _takes.clear()


def _stay(_file: str = "") -> None:
    """Write them as the open file needs them."""
    for owner, name, place in _places:
        _set(owner, name, relative(place))
    _places.clear()
    _set_saved_as(bpy.data.filepath)


def _after_load(_file: str) -> None:
    """A file that was copied or renamed has the takes of the one that it was."""
    _folders.clear()
    if bpy.data.filepath and any(obj.smokelift.saved_as not in ("", bpy.data.filepath) for obj in _smokes()):
        for take in takes_of_file():
            take.note_file(Path(bpy.data.filepath))
    _set_saved_as(bpy.data.filepath)


def _after_undo(_scene: bpy.types.Scene) -> None:
    """Lead relative paths that were meant for an earlier folder to where they led."""
    here = Path(bpy.data.filepath).parent
    for owner, name, path in _settings():
        then = Path(owner.id_data.smokelift.saved_as).parent
        if path.startswith("//") and then != here and then in _folders:
            _set(owner, name, relative(absolute(path, folder=then)))
    for obj in _smokes():
        find_results_again(obj)
    _set_saved_as(bpy.data.filepath)
    if all(folder == here for folder in _folders):  # to ask for every file takes time
        return
    for data in (data for name in _DATA for data in getattr(bpy.data, name)):
        # a part of Blender's data is as it was, and a part as it is; where there is a file, it is the right one
        path = "" if data.library is not None else data.filepath
        if path.startswith("//") and not absolute(path).exists():
            places = (absolute(path, folder=folder) for folder in _folders)
            place = next((place for place in places if place.exists()), None)
            if place is not None:
                data.filepath = relative(place)


def _set_saved_as(file: str) -> None:
    for obj in _smokes():
        _set(obj.smokelift, "saved_as", file)


def _set(settings: bpy.types.PropertyGroup, name: str, path: str) -> None:
    """Set a path unless it is the same: a new one begins a check of the shot."""
    if getattr(settings, name) != path:
        setattr(settings, name, path)


HANDLERS = (
    (bpy.app.handlers.save_pre, _before_save),
    (bpy.app.handlers.save_post, _after_save),
    (bpy.app.handlers.save_post_fail, _stay),
    (bpy.app.handlers.load_post, _after_load),
    (bpy.app.handlers.undo_post, _after_undo),
    (bpy.app.handlers.redo_post, _after_undo),
)
