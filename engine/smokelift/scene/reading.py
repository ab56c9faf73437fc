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


class _Reader(TomlFile):
    """Makes the parts of a scene from the tables of one file and puts file and line into every message."""

    def scene(self, data: Table, build: Callable[..., Described]) -> Described:
        readers: dict[str, Callable[[Place, Any], Any]] = {
            "clip": self._table(self._part(ClipSource)),
            "camera": self._table(self._camera),
            "domain": self._table(self._domain),
            "inlet": self._tables(self._part(Inlet)),
            "medium": self._table(self._part(Medium, "scattering")),
            "lights": self._tables(self._light),
            "background": self._table(self._part(Background)),
            "views": self._tables(self._view),
        }
        self.require_known((), data, tuple(readers))
        parts = {name: readers[name]((name,), value) for name, value in data.items()}
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

    def _table(self, build: Callable[[Place, Table], Any]) -> Callable[[Place, Any], Any]:
        """Return a reader of one table that turns a SceneError without a place into one with it."""

        def read(place: Place, data: Any) -> Any:
            if not isinstance(data, dict):
                raise self.error(place, f"must be a table, not {shown(data)}")
            try:
                return build(place, data)
            except SceneError as error:
                if error.table:
                    raise
                raise self.error(place, str(error), error.key) from error

        return read

    def _tables(self, build: Callable[[Place, Table], Any]) -> Callable[[Place, Any], tuple[Any, ...]]:
        def read(place: Place, data: Any) -> tuple[Any, ...]:
            if not isinstance(data, list):
                raise self.error(place, f"must be a list of tables, written [[{place[0]}]]")
            return tuple(self._table(build)((*place, index), item) for index, item in enumerate(data))

        return read

    def _part(self, kind: type[Any], *beside: str) -> Callable[[Place, Table], Any]:
        """Return a reader of a dataclass whose fields are the keys of its table, with some further keys beside them.

        A field without a default has to be given; a path is relative to the file. A table that holds nothing but
        further keys leaves the part open.
        """

        def read(place: Place, data: Table) -> Any:
            self.require_known(place, data, (*(each.name for each in fields(kind)), *beside))
            values = {key: value for key, value in data.items() if key not in beside}
            if data and not values:
                return None
            _require(values, *(each.name for each in fields(kind) if each.default is MISSING))
            for key, hint in get_type_hints(kind).items():
                if Path in (hint, *get_args(hint)) and isinstance(values.get(key), str):
                    values[key] = self.base / file_path(values[key], key)
            return kind(**values)

        return read

    def _domain(self, place: Place, data: Table) -> Box | None:
        """Return a domain, or a box where the table holds no resolution."""
        read = self._part(Domain, "closed") if "resolution" in data else self._part(Box, "resolution", "closed")
        box: Box | None = read(place, data)
        return box

    def _light(self, place: Place, data: Table) -> Light:
        _require(data, "type")
        name = data["type"]
        if not isinstance(name, str) or name not in LIGHT_TYPES:
            raise unexpected(name, "type", f"one of {one_of(LIGHT_TYPES)}")
        light: Light = self._part(LIGHT_TYPES[name])(place, {key: data[key] for key in data if key != "type"})
        return light

    def _view(self, place: Place, data: Table) -> View:
        readers: dict[str, Callable[[Place, Table], Any]] = {
            "camera": self._camera,
            "clip": self._part(ClipSource),
            "background": self._part(Background),
        }
        self.require_known(place, data, tuple(readers))
        _require(data, "camera", "clip")
        return View(**{key: self._table(readers[key])((*place, key), value) for key, value in data.items()})

    def _camera(self, place: Place, data: Table) -> Camera:
        kind = data.get("type", "perspective")
        lens = "height" if kind == "orthographic" else "fov_y_degrees"
        pose = ("matrices", "matrix", "position", "target", "up")
        self.require_known(place, data, ("type", "size", *pose, "fx", "fy", "cx", "cy", lens))
        _require(data, "size")
        width, height = picture_size(data["size"])
        matrices = _matrices(data)
        fx, fy = _scales(data, lens, height)
        centre = data.get("cx", width / 2), data.get("cy", height / 2)
        moving = matrices if "matrices" in data else ()
        return Camera(kind, matrices[0], (width, height), fx, fy, *centre, moving)


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
