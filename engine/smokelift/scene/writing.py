"""A scene as the tables of a scene file, and the file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from smokelift.checks import listed, printable
from smokelift.scene.camera import Camera
from smokelift.scene.checks import SceneError
from smokelift.scene.lights import LIGHT_TYPES

if TYPE_CHECKING:
    from smokelift.scene.description import Scene

Table = dict[str, Any]
_LIGHT_NAMES = {kind: name for name, kind in LIGHT_TYPES.items()}


def write_file(scene: Scene, path: Path, comments: Sequence[str] = ()) -> None:
    """Write a scene file, whole or not at all, with comments as lines at its top; see `Scene.save`."""
    if path.is_dir():
        raise SceneError(f"{path}: is a folder; give the name of a file")
    top = "".join(f"# {printable(line)}\n" for line in listed(comments, str, "comments", "a list of lines"))
    text = top + tomli_w.dumps(scene_to_dict(scene, path.absolute().parent))
    aside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    except OSError as error:
        error.filename = str(path)  # the name that was asked for
        raise
    finally:
        with suppress(OSError):  # what failed before says why
            aside.unlink(missing_ok=True)


def scene_to_dict(scene: Scene, base: Path | None = None) -> Table:
    """Return a scene as the tables of a scene file: dictionaries, lists, strings and numbers only.

    A complete scene is what `completed` makes of the description that is read back. Paths below the folder `base`
    become relative to it; all others absolute.
    """
    tables: Table = {
        "clip": _table(scene.clip, base),
        "camera": _table(scene.camera, base),
        "domain": _table(scene.domain, base, closed=scene.closed),
        "inlet": [_table(inlet, base) for inlet in scene.inlets] or None,
        "medium": _table(scene.medium, base, scattering=scene.scattering),
        "lights": [_table(light, base) for light in scene.lights] or None,
        "background": _table(scene.background, base),
        "views": [_table(view, base) for view in scene.views] or None,
    }
    return {name: table for name, table in tables.items() if table is not None}


def _table(part: Any, base: Path | None, **beside: Any) -> Table | None:
    """Return the fields of a part that have a value, and what stands beside them in its table.

    The part may be None, and there is no table if nothing stands beside it either.
    """
    values = {} if part is None else {each.name: getattr(part, each.name) for each in fields(part)}
    if type(part) in _LIGHT_NAMES:
        values = {"type": _LIGHT_NAMES[type(part)], **values}
    if isinstance(part, Camera) and part.moves:
        del values["matrix"]  # the first of its matrices
    table = {key: _plain(value, base) for key, value in {**values, **beside}.items() if value not in (None, ())}
    return None if part is None and not table else table


def _plain(value: Any, base: Path | None) -> Any:
    """Return a value as TOML and JSON know it."""
    if isinstance(value, tuple):
        return [_plain(item, base) for item in value]
    if isinstance(value, Path):
        return _path(value, base)
    return _table(value, base) if is_dataclass(value) else value


def _path(path: Path, base: Path | None) -> str:
    whole = path.absolute()  # links are not followed: their names may carry the number of a frame
    if base is not None and whole.is_relative_to(base):
        whole = whole.relative_to(base)
    return whole.as_posix()
