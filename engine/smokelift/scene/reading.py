"""Reading scene files, with the file, the line and the key of whatever is wrong in the message.

A scene file holds the tables [clip], [camera], [domain], [[inlet]], [medium], [[lights]], [background] and [[views]],
each of them optional. Their keys are the fields of the classes of the same names, with these exceptions:

- ``[domain] closed`` lists the walls of the box. A ``[domain]`` that holds nothing else leaves the box to be estimated,
  one without ``resolution`` leaves that to the quality.
- ``[medium] scattering`` is how light is scattered: ``"multiple"`` (any number of times), ``"single"`` (once, with
  shadows), ``"unshadowed"`` (once, without) or ``"absorption"`` (not at all). A ``[medium]`` that holds nothing else
  leaves the medium to be estimated.
- ``[camera]`` takes ``position``, ``target`` and ``up`` in place of ``matrix``, and ``fov_y_degrees``, or the
  ``height`` in meters of an orthographic picture, in place of ``fx`` and ``fy``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

from smokelift.checks import one_of, shown
from smokelift.scene.camera import Camera, focal_length, look_at_matrix, picture_size
from smokelift.scene.checks import SceneError, file_path, positive, unexpected
from smokelift.scene.domain import Box, Domain, Inlet
from smokelift.scene.lights import LIGHT_TYPES, Light
from smokelift.scene.medium import Medium
from smokelift.scene.toml_files import Place, TomlFile, read_toml
from smokelift.scene.view import Background, ClipSource, View

Table = Mapping[str, Any]
Described = TypeVar("Described")


def read_file(path: Path, build: Callable[..., Described]) -> Described:
    """Read a scene file; relative paths in it are relative to the file.

    Parameters
    ----------
    path
        The file.
    build
        Makes the scene from its fields, given by name.

    Raises
    ------
    SceneError
        With the file, the line, the key, what was expected and what was found.
    """
    data, file = read_toml(path)
    return _Reader(file.name, file.base, file.lines).scene(data, build)


def from_tables(data: Table, build: Callable[..., Described], name: str, base: Path | None) -> Described:
    """Make a scene from the tables of a scene file; see `smokelift.scene.scene_from_dict`."""
    return _Reader(name, (base or Path()).absolute(), {}).scene(data, build)


TABLES: Mapping[str, Any] = {
    "clip": ClipSource,
    "camera": Camera,
    "domain": Domain,
    "inlet": Inlet,
    "medium": Medium,
    "lights": Light,
    "background": Background,
    "views": View,
}
"""What the tables of a scene file describe."""

LISTS = ("inlet", "lights", "views")
"""Tables that may be given again."""

BESIDE: Mapping[Any, tuple[str, ...]] = {Domain: ("closed",), Box: ("resolution", "closed"), Medium: ("scattering",)}
"""Keys of a table that are no fields of what it describes."""


class _Reader(TomlFile):
    """Makes the parts of a scene from the tables of one file and puts file and line into every message."""

    def scene(self, data: Table, build: Callable[..., Described]) -> Described:
        self.require_known((), data, tuple(TABLES))
        parts: dict[str, Any] = {}
        for name, value in data.items():
            if name not in LISTS:
                parts[name] = self._table((name,), value, TABLES[name])
            elif isinstance(value, list):
                parts[name] = tuple(self._table((name, n), each, TABLES[name]) for n, each in enumerate(value))
            else:
                raise self.error((name,), f"must be a list of tables, written [[{name}]]")
        for table, key in (("domain", "closed"), ("medium", "scattering")):
            if key in data.get(table, {}):
                parts[key] = data[table][key]
        if "inlet" in parts:
            parts["inlets"] = parts.pop("inlet")
        try:
            return build(**parts)
        except SceneError as error:
            place = tuple(int(part) if part.isdigit() else part for part in error.table.split("."))
            raise self.error(place, str(error), error.key) from error

    def _table(self, place: Place, data: Any, kind: Any) -> Any:
        """Return what a table describes; a SceneError without a place becomes one with it."""
        if not isinstance(data, dict):
            raise self.error(place, f"must be a table, not {shown(data)}")
        try:
            return self._camera(place, data) if kind is Camera else self._part(place, data, kind)
        except SceneError as error:
            if error.table:
                raise
            raise self.error(place, str(error), error.key) from error

    def _part(self, place: Place, data: Table, kind: Any) -> Any:
        """Return a dataclass whose fields are the keys of its table.

        A field without a default has to be given; a path is relative to the file. A table that holds nothing but keys
        `BESIDE` leaves the part open.
        """
        if kind is Light:
            kind, data = _light_type(data), {key: value for key, value in data.items() if key != "type"}
        if kind is Domain and "resolution" not in data:
            kind = Box
        beside = BESIDE.get(kind, ())
        self.require_known(place, data, (*(each.name for each in fields(kind)), *beside))
        values = {key: value for key, value in data.items() if key not in beside}
        if data and not values:
            return None
        _require(values, *(each.name for each in fields(kind) if each.default is MISSING))
        for key, hint in get_type_hints(kind).items():
            kinds = (hint, *get_args(hint))
            if Path in kinds and isinstance(values.get(key), str):
                values[key] = self.base / file_path(values[key], key)
            for table in (Camera, ClipSource, Background):
                if table in kinds and key in values:
                    values[key] = self._table((*place, key), values[key], table)
        return kind(**values)

    def _camera(self, place: Place, data: Table) -> Camera:
        kind = data.get("type", "perspective")
        lens = "height" if kind == "orthographic" else "fov_y_degrees"
        pose = ("matrices", "matrix", "position", "target", "up")
        self.require_known(place, data, ("type", "size", *pose, "fx", "fy", "cx", "cy", lens))
        _require(data, "size")
        width, height = picture_size(data["size"])
        matrices = _matrices(data)
        fx, fy = _scales(data, lens, height)
        center = data.get("cx", width / 2), data.get("cy", height / 2)
        moving = matrices if "matrices" in data else ()
        return Camera(kind, matrices[0], (width, height), fx, fy, *center, moving)


def _light_type(data: Table) -> Any:
    _require(data, "type")
    name = data["type"]
    if not isinstance(name, str) or name not in LIGHT_TYPES:
        raise unexpected(name, "type", f"one of {one_of(LIGHT_TYPES)}")
    return LIGHT_TYPES[name]


def _require(data: Table, *keys: str) -> None:
    for key in keys:
        if key not in data:
            raise SceneError(f"lacks {key}")


def _exclude(data: Table, given: str, *others: str) -> None:
    """Refuse what would say the same as a key that is given."""
    for key in others:
        if key in data:
            raise SceneError(f"takes {given} or {key}, not both", key=key)


def _matrices(data: Table) -> tuple[Any, ...]:
    """Return the camera to world matrix of every frame, or the one of a camera that stands still."""
    look_at = ("position", "target", "up")
    if "matrices" in data:
        _exclude(data, "matrices", "matrix", *look_at)
        matrices = data["matrices"]
        if not isinstance(matrices, list) or not matrices:
            raise unexpected(matrices, "matrices", "a list of 4x4 matrices, camera to world, one a frame")
        return tuple(matrices)
    if "matrix" in data:
        _exclude(data, "matrix", *look_at)
        return (data["matrix"],)
    if "position" not in data or "target" not in data:
        raise SceneError("needs matrix, or position and target")
    return (look_at_matrix(data["position"], data["target"], data.get("up", (0.0, 0.0, 1.0))),)


def _scales(data: Table, lens: str, height: int) -> tuple[Any, Any]:
    """Return fx and fy of a camera whose picture is ``height`` pixels high."""
    if lens not in data:
        if "fx" not in data:
            raise SceneError(f"needs {lens} or fx")
        return data["fx"], data.get("fy", data["fx"])
    _exclude(data, lens, "fx", "fy")
    if lens == "fov_y_degrees":
        focal = focal_length(data[lens], height)
    else:
        focal = height / positive(data[lens], lens, "a number of meters above 0")
    return focal, focal
