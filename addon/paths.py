"""Blender's paths as the file system has them."""

import os
from pathlib import Path

import bpy

# Blender 4.5 and later need this option for // as the .blend's folder; older ones do not know it.
PATH_OPTIONS = {"ANIMATABLE"} | ({"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set())
"""Options of properties that hold a path."""


def absolute(path: str, library: bpy.types.Library | None = None, folder: Path | None = None) -> Path:
    """The absolute path, without the ``..`` that Blender's relative paths begin with: so it can be compared.

    Parameters
    ----------
    path
        As Blender keeps it; ``//`` is the folder of the .blend, or of the library.
    library
        The .blend that the owner of the path is linked from.
    folder
        Of the .blend; by default of the open one, or of the library.
    """
    found = bpy.path.abspath(path, start=None if folder is None else str(folder), library=library)
    return Path(os.path.abspath(found))  # noqa: PTH100 - resolve() follows links, which Blender keeps


def relative(path: Path, folder: Path | None = None) -> str:
    """The path as Blender keeps it: relative to a saved .blend on the same drive, else absolute.

    Parameters
    ----------
    path
        Absolute.
    folder
        Of the .blend; by default of the open one.
    """
    if folder is None and not bpy.data.filepath:
        return str(path)
    try:
        return bpy.path.relpath(str(path), start=None if folder is None else str(folder))
    except ValueError:  # on another drive
        return str(path)
