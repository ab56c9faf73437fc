"""Scene files, TOML with the parts of a scene as tables, both ways; what is wrong is named with file, line and key.

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

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import tomli_w

from smokelift.checks import listed, one_of, printable, shown
from smokelift.checks.whole_files import atomic_path, read_text
from smokelift.scene.camera import Camera, focal_length, look_at_matrix, picture_size
from smokelift.scene.checks import SceneError, file_path, positive, unexpected
from smokelift.scene.domain import Box, Domain, Inlet
from smokelift.scene.lights import LIGHT_TYPES, Light, Medium
from smokelift.scene.view import Background, ClipSource, View

Table = Mapping[str, Any]

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

BESIDE: Mapping[str, str] = {"domain": "closed", "medium": "scattering"}
"""A key of a table that is a field of the scene, by the table."""

_FIELDS = {name: "inlets" if name == "inlet" else name for name in TABLES}
"""The field of a scene that a table describes."""

_LIGHT_NAMES = {kind: name for name, kind in LIGHT_TYPES.items()}

Place = tuple[str | int, ...]
"""Names of nested tables and a key, with the index of a table in a list of them: ``("lights", 1, "direction")``."""

_HEADER = re.compile(r"\s*(\[\[?)\s*([\w\-.\"' ]+?)\s*\]")
_KEY = re.compile(r"\s*([\w\-.\"' ]+?)\s*=")


@dataclass(frozen=True)
class TomlFile:
    """What messages say of a TOML file: its name, and the line of each place. Paths in it are relative to ``base``."""

    name: str
    base: Path
    lines: Mapping[Place, int]

    def error(self, place: Place, message: str, key: str = "") -> SceneError:
        """Return an error that names the file, the line of the key (or of its table) and the table."""
        stands: Place = (*place, key) if key else place
        while stands and stands not in self.lines:
            stands = stands[:-1]
        line = f", line {self.lines[stands]}" if stands else ""
        header = ".".join(part for part in place if isinstance(part, str))
        if place:
            header = f"[[{header}]] " if isinstance(place[-1], int) else f"[{header}] "
        return SceneError(f"{self.name}{line}: {header}{message}", key=key, table=".".join(map(str, place)))

    def require_known(self, place: Place, table: Mapping[str, Any], keys: tuple[str, ...]) -> None:
        """Refuse a key that a table does not have."""
        for key in table:
            if key not in keys:
                what, known = "key" if place else "table", ", ".join(keys)
                raise self.error(place, f"there is no {what} {shown(key)} here; known are {known}", key)


def read_toml(path: Path) -> tuple[dict[str, Any], TomlFile]:
    """Read a TOML file; SceneError with the path if it cannot be read or is none."""
    try:
        text = read_text(path)
    except (OSError, ValueError) as error:
        raise SceneError(str(error)) from error
    try:
        return tomllib.loads(text), TomlFile(path.name, path.absolute().parent, _find_lines(text))
    except RecursionError as error:
        raise SceneError(f"{path.name}: is not valid TOML: lists or tables are nested too deeply") from error
    except ValueError as error:  # an integer of 5000 digits is no error of TOML's
        advice = "; write a path with / or between single quotes" if "\\" in text else ""
        raise SceneError(f"{path.name}: is not valid TOML: {error}{advice}") from error


def write_toml(path: Path, data: Mapping[str, Any], comments: Sequence[str] = ()) -> None:
    """Write a TOML file, whole or not at all, with comments as lines at its top; SceneError if that is a folder."""
    if path.is_dir():
        raise SceneError(f"{path}: is a folder; give the name of a file")
    top = "".join(f"# {printable(line)}\n" for line in listed(comments, str, "comments", "a list of lines"))
    with atomic_path(path) as temporary:
        temporary.write_text(top + tomli_w.dumps(data), encoding="utf-8")


def _find_lines(text: str) -> dict[Place, int]:
    """Return the line (from 1) of every table and key in valid TOML.

    A key of the second [[lights]] table is found under ``("lights", 1, "direction")``. Keys inside inline
    tables are not listed; their table is. Multi-line strings, which no scene needs, are not understood.
    """
    lines: dict[Place, int] = {}
    counts: dict[Place, int] = {}
    table: Place = ()
    depth = 0
    for index, line in enumerate(text.splitlines(), 1):
        if depth == 0:
            if header := _HEADER.match(line):
                table = ()
                names = _names(header[2])
                for position, part in enumerate(names):
                    table = (*table, part)
                    lines.setdefault(table, index)
                    if header[1] == "[[" and position == len(names) - 1:
                        counts[table] = counts.get(table, -1) + 1
                    if table in counts:
                        table = (*table, counts[table])
                        lines.setdefault(table, index)
                continue
            if key := _KEY.match(line):
                place = table
                for part in _names(key[1]):
                    place = (*place, part)
                    lines.setdefault(place, index)
        bare = re.sub(r'"(\\.|[^"\\])*"|\'[^\']*\'|#.*', "", line)
        depth += bare.count("[") + bare.count("{") - bare.count("]") - bare.count("}")
    return lines


def _names(dotted: str) -> list[str]:
    return [part.strip().strip("\"'") for part in dotted.split(".")]


def scene_to_dict(scene: object, base: Path | None = None) -> dict[str, Any]:
    """Return a `Scene` as the tables of a scene file: dictionaries, lists, strings and numbers only.

    A complete scene is what `completed` makes of the description that is read back. Paths below the folder `base`
    become relative to it; all others absolute.
    """
    tables: dict[str, Any] = {}
    given = vars(scene)
    for name, field in _FIELDS.items():
        part, beside = given[field], {key: given[key] for table, key in BESIDE.items() if table == name}
        if name in LISTS:
            tables[name] = [_plain(each, base) for each in part]
        else:
            tables[name] = _plain_table({**({} if part is None else _values(part)), **beside}, base)
    return {name: table for name, table in tables.items() if table or given[_FIELDS[name]]}


def _values(part: Any) -> dict[str, Any]:
    """Return the keys of a part's table with their values."""
    values = {each.name: getattr(part, each.name) for each in fields(part)}
    if isinstance(part, Camera) and part.moves:
        del values["matrix"]  # the first of its matrices
    return {"type": _LIGHT_NAMES[type(part)], **values} if type(part) in _LIGHT_NAMES else values


def _plain_table(values: Table, base: Path | None) -> dict[str, Any]:
    return {key: _plain(value, base) for key, value in values.items() if value not in (None, ())}


def _plain(value: Any, base: Path | None) -> Any:
    """Return a value as TOML and JSON know it; paths below the folder ``base`` become relative to it."""
    if isinstance(value, tuple):
        return [_plain(item, base) for item in value]
    if isinstance(value, Path):
        whole = value.absolute()  # links are not followed: their names may carry the number of a frame
        return (whole.relative_to(base) if base is not None and whole.is_relative_to(base) else whole).as_posix()
    return _plain_table(_values(value), base) if is_dataclass(value) else value


def from_tables(data: Table, file: TomlFile) -> dict[str, Any]:
    """Return the fields of the scene that the tables of a file describe.

    It raises SceneError with the file, the line, the key, what was expected and what was found.
    """
    file.require_known((), data, tuple(TABLES))
    found: dict[str, Any] = {}
    for name, value in data.items():
        if name not in LISTS:
            found[name] = _described(file, (name,), value, TABLES[name])
        elif isinstance(value, list):
            found[_FIELDS[name]] = tuple(
                _described(file, (name, n), each, TABLES[name]) for n, each in enumerate(value)
            )
        else:
            raise file.error((name,), f"must be a list of tables, written [[{name}]]")
    return found | {key: data[table][key] for table, key in BESIDE.items() if key in data.get(table, {})}


def _described(file: TomlFile, place: Place, data: Any, kind: Any) -> Any:
    """Return what a table describes; a SceneError without a place becomes one with it."""
    if not isinstance(data, dict):
        raise file.error(place, f"must be a table, not {shown(data)}")
    try:
        return _camera(file, place, data) if kind is Camera else _part(file, place, data, kind)
    except SceneError as error:
        if error.table:
            raise
        raise file.error(place, str(error), error.key) from error


def _part(file: TomlFile, place: Place, data: Table, kind: Any) -> Any:
    """Return a dataclass whose fields are the keys of its table.

    A field without a default has to be given; a path is relative to the file. A table that holds nothing but a key
    `BESIDE` leaves the part open.
    """
    if kind is Light:
        kind, data = _light_type(data), {key: value for key, value in data.items() if key != "type"}
    beside = [key for table, key in BESIDE.items() if place == (table,)]
    file.require_known(place, data, (*(each.name for each in fields(kind)), *beside))
    if kind is Domain and "resolution" not in data:
        kind = Box
    values = {key: value for key, value in data.items() if key not in beside}
    if data and not values:
        return None
    _require(values, *(each.name for each in fields(kind) if each.default is MISSING))
    for key, hint in get_type_hints(kind).items():
        kinds = (hint, *get_args(hint))
        if Path in kinds and isinstance(values.get(key), str):
            values[key] = file.base / file_path(values[key], key)
        for table in (Camera, ClipSource, Background):
            if table in kinds and key in values:
                values[key] = _described(file, (*place, key), values[key], table)
    return kind(**values)


def _camera(file: TomlFile, place: Place, data: Table) -> Camera:
    kind = data.get("type", "perspective")
    lens = "height" if kind == "orthographic" else "fov_y_degrees"
    pose = ("matrices", "matrix", "position", "target", "up")
    file.require_known(place, data, ("type", "size", *pose, "fx", "fy", "cx", "cy", lens))
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
            raise unexpected(matrices, "matrices", "a list of 4x4 matrices, camera to world, one per frame")
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
