"""Scenes as plain dictionaries: the tables of a scene file, as a sequence keeps them in its JSON."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from smokelift.scene.complete import CompleteScene
from smokelift.scene.description import Scene
from smokelift.scene.reading import from_tables
from smokelift.scene.writing import to_tables


def scene_from_dict(data: Mapping[str, Any], name: str = "scene", base: Path | None = None) -> Scene:
    """Return the scene that a plain dictionary describes.

    Parameters
    ----------
    data
        The tables of a scene file.
    name
        What messages call the source.
    base
        Folder that relative paths are relative to; None is the current one.

    Raises
    ------
    SceneError
        For the same reasons as `Scene.load`.
    """
    return from_tables(data, Scene, name, base)


def scene_to_dict(scene: Scene | CompleteScene, base: Path | None = None) -> dict[str, Any]:
    """Return a scene as the tables of a scene file: dictionaries, lists, strings and numbers only.

    Parameters
    ----------
    scene
        Any scene. A complete one is what `completed` makes of the description that is read back.
    base
        Paths below this folder become relative to it; all others absolute.
    """
    return to_tables(vars(scene), base)
