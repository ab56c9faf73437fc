"""Reading and writing scene files (TOML), with the line of whatever is wrong in the message.

The standard TOML reader gives values without positions; a small scanner finds the line of every table and
key. The same plain dictionaries serve the scene that a sequence keeps in its JSON.

``[medium] scattering`` is how light is scattered: ``"single"`` (once, with shadows), ``"unshadowed"`` (once, without
them) or ``"absorption"`` (never). A ``[medium]`` that holds nothing else leaves the medium to be estimated.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from smokelift.output.files import atomic_path
from smokelift.scene.complete import CompleteScene
from smokelift.scene.description import (
    Background,
    Camera,
    ClipSource,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    Inlet,
    Light,
    Medium,
    PointLight,
    Scene,
    SceneError,
    View,
    focal_length,
    look_at_matrix,
    number,
    picture_size,
    shown,
)

Place = tuple[str | int, ...]
Table = Mapping[str, Any]

_CLIP_KEYS = ("path", "fps", "frames", "transfer")
_LIGHT_KEYS = {
    "directional": ("direction", "irradiance"),
    "point": ("position", "intensity"),
    "environment": ("image", "rotation_degrees", "strength", "directions"),
}


def load_scene(path: Path) -> Scene:
    """Read a scene file; see :meth:`smokelift.scene.Scene.load`."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: is not a text file in UTF-8") from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path.name}: is not valid TOML: {error}") from error
    return _Reader(path.name, path.absolute().parent, find_lines(text)).scene(data)


def save_scene(scene: Scene, path: Path) -> None:
    """Write a scene file; see :meth:`smokelift.scene.Scene.save`."""
    data = scene_to_dict(scene, path.absolute().parent)
    with atomic_path(path) as aside:
        aside.write_text(tomli_w.dumps(data), encoding="utf-8")


def scene_from_dict(data: Table, name: str = "scene", base: Path | None = None) -> Scene:
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
        For the same reasons as :meth:`smokelift.scene.Scene.load`.
    """
    return _Reader(name, (base or Path()).absolute(), {}).scene(data)


def scene_to_dict(scene: Scene | CompleteScene, base: Path | None = None) -> dict[str, Any]:
    """Return a scene as the tables of a scene file: dictionaries, lists, strings and numbers only.

    Parameters
    ----------
    scene
        Any scene. A complete one is what `completed` makes of the description that is read back.
    base
        Paths below this folder become relative to it; all others absolute.
    """
    data: dict[str, Any] = {}
    if scene.clip is not None:
        data["clip"] = _clip_to_dict(scene.clip, base)
    if scene.camera is not None:
        data["camera"] = _camera_to_dict(scene.camera)
    if scene.domain is not None or scene.closed:
        data["domain"] = _domain_to_dict(scene)
    if scene.inlets:
        data["inlet"] = [{"centre": list(inlet.centre), "radius": inlet.radius} for inlet in scene.inlets]
    if scene.medium is not None or scene.scattering is not None:
        data["medium"] = _medium_to_dict(scene)
    if scene.lights:
        data["lights"] = [_light_to_dict(light, base) for light in scene.lights]
    if scene.background is not None:
        data["background"] = _background_to_dict(scene.background, base)
    if scene.views:
        data["views"] = [_view_to_dict(view, base) for view in scene.views]
    return data


def _background_to_dict(background: Background, base: Path | None) -> dict[str, Any]:
    table: dict[str, Any] = {}
    if background.color is not None:
        table["color"] = list(background.color)
    if background.image is not None:
        table["image"] = _written(background.image, base)
    return table


def _view_to_dict(view: View, base: Path | None) -> dict[str, Any]:
    data: dict[str, Any] = {"camera": _camera_to_dict(view.camera), "clip": _clip_to_dict(view.clip, base)}
    if view.background is not None:
        data["background"] = _background_to_dict(view.background, base)
    return data


def _medium_to_dict(scene: Scene | CompleteScene) -> dict[str, Any]:
    medium = scene.medium
    table: dict[str, Any] = {}
    if medium is not None:
        table = {"extinction": medium.extinction, "albedo": medium.albedo, "anisotropy": medium.anisotropy}
    return table if scene.scattering is None else {**table, "scattering": scene.scattering}


def _domain_to_dict(scene: Scene | CompleteScene) -> dict[str, Any]:
    domain = scene.domain
    box: dict[str, Any] = {}
    if domain is not None:
        box = {"min": list(domain.min), "max": list(domain.max), "resolution": list(domain.resolution)}
    return {**box, "closed": list(scene.closed)} if scene.closed else box


def _written(path: Path, base: Path | None) -> str:
    whole = path.absolute()  # links are not followed: their names may carry the number of a frame
    if base is not None and whole.is_relative_to(base):
        whole = whole.relative_to(base)
    return whole.as_posix()


def _clip_to_dict(clip: ClipSource, base: Path | None) -> dict[str, Any]:
    data: dict[str, Any] = {"path": _written(clip.path, base)}
    if clip.fps is not None:
        data["fps"] = clip.fps
    if clip.frames is not None:
        data["frames"] = list(clip.frames)
    if clip.transfer is not None:
        data["transfer"] = clip.transfer
    return data


def _camera_to_dict(camera: Camera) -> dict[str, Any]:
    return {
        "type": camera.type,
        **(
            {"matrices": [[list(row) for row in matrix] for matrix in camera.matrices]}
            if camera.moves
            else {"matrix": [list(row) for row in camera.matrix]}
        ),
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "size": list(camera.size),
    }


def _light_to_dict(light: Light, base: Path | None) -> dict[str, Any]:
    match light:
        case DirectionalLight():
            return {
                "type": "directional",
                "direction": list(light.direction),
                "irradiance": list(light.irradiance),
            }
        case PointLight():
            return {"type": "point", "position": list(light.position), "intensity": list(light.intensity)}
        case EnvironmentLight():
            return {
                "type": "environment",
                "image": _written(light.image, base),
                "rotation_degrees": light.rotation_degrees,
                "strength": light.strength,
                **({} if light.directions is None else {"directions": light.directions}),
            }


@dataclass(frozen=True)
class _Reader:
    """Builds a scene from the tables of one file and puts file and line into every message."""

    name: str
    base: Path
    lines: Mapping[Place, int]

    def scene(self, data: Table) -> Scene:
        readers: dict[str, Callable[[Place, Any], Any]] = {
            "clip": self._table(self._clip),
            "camera": self._table(self._camera),
            "domain": self._table(self._domain),
            "inlet": self._tables(self._inlet),
            "medium": self._table(self._medium),
            "lights": self._tables(self._light),
            "background": self._table(self._background),
            "views": self._tables(self._view),
        }
        self._known((), data, tuple(readers))
        parts = {name: readers[name]((name,), value) for name, value in data.items()}
        if "domain" in parts:
            parts["domain"], parts["closed"] = parts["domain"]
        if "inlet" in parts:
            parts["inlets"] = parts.pop("inlet")
        if "medium" in parts:
            parts["medium"], parts["scattering"] = parts["medium"]
        try:
            return Scene(**parts)
        except SceneError as error:
            place = tuple(int(part) if part.isdigit() else part for part in error.table.split("."))
            raise self._error(place, str(error), error.key) from error

    def _error(self, place: Place, message: str, key: str = "") -> SceneError:
        """Return an error that names the file, the line of the key (or of its table) and the table."""
        where = (*place, key) if key else place
        while where and where not in self.lines:
            where = where[:-1]
        line = f", line {self.lines[where]}" if where else ""
        header = ".".join(part for part in place if isinstance(part, str))
        if place:
            header = f"[[{header}]] " if isinstance(place[-1], int) else f"[{header}] "
        return SceneError(f"{self.name}{line}: {header}{message}", key=key, table=".".join(map(str, place)))

    def _known(self, place: Place, data: Table, keys: tuple[str, ...]) -> None:
        for key in data:
            if key not in keys:
                what = "key" if place else "table"
                known = ", ".join(keys)
                raise self._error(place, f"there is no {what} {shown(key)} here; known are {known}", key)

    def _table(self, build: Callable[[Place, Table], Any]) -> Callable[[Place, Any], Any]:
        """Return a reader of one table that turns a SceneError without a place into one with it."""

        def read(place: Place, data: Any) -> Any:
            if not isinstance(data, dict):
                raise self._error(place, f"must be a table, not {shown(data)}")
            try:
                return build(place, data)
            except SceneError as error:
                if error.table:
                    raise
                raise self._error(place, str(error), error.key) from error

        return read

    def _tables(self, build: Callable[[Place, Table], Any]) -> Callable[[Place, Any], tuple[Any, ...]]:
        def read(place: Place, data: Any) -> tuple[Any, ...]:
            if not isinstance(data, list):
                raise self._error(place, f"must be a list of tables, written [[{place[0]}]]")
            return tuple(self._table(build)((*place, index), item) for index, item in enumerate(data))

        return read

    def _needed(self, data: Table, *keys: str) -> None:
        for key in keys:
            if key not in data:
                raise SceneError(f"lacks {key}")

    def _file(self, data: Table, key: str) -> dict[str, Any]:
        """Return the table with the path under ``key`` made absolute."""
        if isinstance(data.get(key), str) and data[key]:
            return {**data, key: self.base / data[key]}
        return dict(data)

    def _clip(self, place: Place, data: Table) -> ClipSource:
        self._known(place, data, _CLIP_KEYS)
        self._needed(data, "path")
        return ClipSource(**self._file(data, "path"))

    def _domain(self, place: Place, data: Table) -> tuple[Domain | None, Any]:
        """Read the box and its walls. Walls alone are those of the box that will be found."""
        keys = ("min", "max", "resolution")
        self._known(place, data, (*keys, "closed"))
        box = {key: value for key, value in data.items() if key != "closed"}
        closed = data.get("closed", ())
        if not box and "closed" in data:
            return None, closed
        self._needed(data, *keys)
        return Domain(**box), closed

    def _inlet(self, place: Place, data: Table) -> Inlet:
        keys = ("centre", "radius")
        self._known(place, data, keys)
        self._needed(data, *keys)
        return Inlet(**data)

    def _medium(self, place: Place, data: Table) -> tuple[Medium | None, Any]:
        """Read the medium and how it scatters light. Scattering alone is that of the medium that will be found."""
        self._known(place, data, ("extinction", "albedo", "anisotropy", "scattering"))
        properties = {key: value for key, value in data.items() if key != "scattering"}
        if not properties and "scattering" in data:
            return None, data["scattering"]
        return Medium(**properties), data.get("scattering")

    def _background(self, place: Place, data: Table) -> Background:
        self._known(place, data, ("color", "image"))
        return Background(**self._file(data, "image"))

    def _light(self, place: Place, data: Table) -> Light:
        self._needed(data, "type")
        kind = data["type"]
        if not isinstance(kind, str) or kind not in _LIGHT_KEYS:
            known = ", ".join(f'"{name}"' for name in _LIGHT_KEYS)
            raise SceneError(f"type must be one of {known}, not {shown(kind)}", key="type")
        values = {key: value for key, value in data.items() if key != "type"}
        self._known(place, values, _LIGHT_KEYS[kind])
        if kind == "environment":
            self._needed(data, "image")
            return EnvironmentLight(**self._file(values, "image"))
        self._needed(data, *_LIGHT_KEYS[kind])
        return DirectionalLight(**values) if kind == "directional" else PointLight(**values)

    def _view(self, place: Place, data: Table) -> View:
        readers: dict[str, Callable[[Place, Table], Any]] = {
            "camera": self._camera,
            "clip": self._clip,
            "background": self._background,
        }
        self._known(place, data, tuple(readers))
        self._needed(data, "camera", "clip")
        return View(**{key: self._table(readers[key])((*place, key), value) for key, value in data.items()})

    def _camera(self, place: Place, data: Table) -> Camera:
        kind = data.get("type", "perspective")
        lens = ("height",) if kind == "orthographic" else ("fov_y_degrees",)
        pose = ("matrices", "matrix", "position", "target", "up")
        self._known(place, data, ("type", "size", *pose, "fx", "fy", "cx", "cy", *lens))
        self._needed(data, "size")
        width, height = picture_size(data["size"])
        given = next((key for key in pose[:2] if key in data), None)
        matrices: tuple[Any, ...] = ()
        if given is not None:
            for key in pose[pose.index(given) + 1 :]:
                if key in data:
                    raise SceneError(f"takes {given} or {key}, not both", key=key)
            matrix = data[given]
            if given == "matrices":
                if not isinstance(matrix, list) or not matrix:
                    expected = "a list of 4x4 matrices, camera to world, one a frame"
                    raise SceneError(f"matrices must be {expected}, not {shown(matrix)}", key=given)
                matrices, matrix = tuple(matrix), matrix[0]
        else:
            if "position" not in data or "target" not in data:
                raise SceneError("needs matrix, or position and target")
            matrix = look_at_matrix(data["position"], data["target"], data.get("up", (0.0, 0.0, 1.0)))
        if lens[0] in data:
            for key in ("fx", "fy"):
                if key in data:
                    raise SceneError(f"takes {lens[0]} or {key}, not both", key=key)
            fx = fy = _focal(lens[0], data[lens[0]], height)
        else:
            if "fx" not in data:
                raise SceneError(f"needs {lens[0]} or fx")
            fx, fy = data["fx"], data.get("fy", data["fx"])
        centre = data.get("cx", width / 2), data.get("cy", height / 2)
        return Camera(kind, matrix, (width, height), fx, fy, *centre, matrices)


def _focal(key: str, value: Any, height: int) -> float:
    if key == "fov_y_degrees":
        return focal_length(value, height)
    metres = number(value, key, "a number of metres above 0")
    if metres <= 0.0:
        raise SceneError(f"{key} must be a number of metres above 0, not {shown(value)}", key=key)
    return height / metres


_HEADER = re.compile(r"\s*(\[\[?)\s*([\w\-.\"' ]+?)\s*\]")
_KEY = re.compile(r"\s*([\w\-.\"' ]+?)\s*=")


def find_lines(text: str) -> dict[Place, int]:
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
