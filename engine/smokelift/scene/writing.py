"""A scene as the tables of a scene file, and the file."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import tomli_w

from smokelift.scene.background import Background
from smokelift.scene.camera import Camera
from smokelift.scene.clip_source import ClipSource
from smokelift.scene.domain import Domain, Inlet, Side
from smokelift.scene.lights import DirectionalLight, EnvironmentLight, Light, PointLight
from smokelift.scene.medium import Medium, Scattering
from smokelift.scene.view import View

Table = dict[str, Any]
Part = TypeVar("Part")


def write_file(parts: Mapping[str, Any], path: Path) -> None:
    """Write a scene file, whole or not at all; paths below its folder become relative to it.

    Parameters
    ----------
    parts
        The fields of a scene by name.
    path
        The file.
    """
    text = tomli_w.dumps(to_tables(parts, path.absolute().parent))
    aside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def to_tables(parts: Mapping[str, Any], base: Path | None) -> Table:
    """Return the tables of a scene file: dictionaries, lists, strings and numbers only.

    Parameters
    ----------
    parts
        The fields of a scene by name. What is None or empty has no table.
    base
        Paths below this folder become relative to it, all others absolute.
    """
    tables = {
        "clip": _optional(parts["clip"], lambda clip: _clip(clip, base)),
        "camera": _optional(parts["camera"], _camera),
        "domain": _domain(parts["domain"], parts["closed"]),
        "inlet": [_inlet(inlet) for inlet in parts["inlets"]] or None,
        "medium": _medium(parts["medium"], parts["scattering"]),
        "lights": [_light(light, base) for light in parts["lights"]] or None,
        "background": _optional(parts["background"], lambda background: _background(background, base)),
        "views": [_view(view, base) for view in parts["views"]] or None,
    }
    return _without_none(tables)


def _optional(part: Part | None, table: Callable[[Part], Table]) -> Table | None:
    return None if part is None else table(part)


def _without_none(table: Table) -> Table:
    return {key: value for key, value in table.items() if value is not None}


def _path(path: Path, base: Path | None) -> str:
    whole = path.absolute()  # links are not followed: their names may carry the number of a frame
    if base is not None and whole.is_relative_to(base):
        whole = whole.relative_to(base)
    return whole.as_posix()


def _clip(clip: ClipSource, base: Path | None) -> Table:
    frames = None if clip.frames is None else list(clip.frames)
    return _without_none({"path": _path(clip.path, base), "fps": clip.fps, "frames": frames, "transfer": clip.transfer})


def _camera(camera: Camera) -> Table:
    matrices = [[list(row) for row in matrix] for matrix in camera.matrices or (camera.matrix,)]
    return {
        "type": camera.type,
        **({"matrices": matrices} if camera.moves else {"matrix": matrices[0]}),
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "size": list(camera.size),
    }


def _domain(domain: Domain | None, closed: tuple[Side, ...]) -> Table | None:
    """Return the box and its walls; walls alone are those of the box that will be found."""
    table: Table = {}
    if domain is not None:
        table = {"min": list(domain.min), "max": list(domain.max), "resolution": list(domain.resolution)}
    if closed:
        table["closed"] = list(closed)
    return table or None


def _inlet(inlet: Inlet) -> Table:
    return {"centre": list(inlet.centre), "radius": inlet.radius}


def _medium(medium: Medium | None, scattering: Scattering | None) -> Table | None:
    """Return the medium and how it scatters light; scattering alone is that of the medium that will be found."""
    table: Table = {}
    if medium is not None:
        table = {"extinction": medium.extinction, "albedo": medium.albedo, "anisotropy": medium.anisotropy}
    if scattering is not None:
        table["scattering"] = scattering
    return table or None


def _light(light: Light, base: Path | None) -> Table:
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
            return _without_none(
                {
                    "type": "environment",
                    "image": _path(light.image, base),
                    "rotation_degrees": light.rotation_degrees,
                    "strength": light.strength,
                    "directions": light.directions,
                }
            )


def _background(background: Background, base: Path | None) -> Table:
    color = None if background.color is None else list(background.color)
    image = None if background.image is None else _path(background.image, base)
    return _without_none({"color": color, "image": image})


def _view(view: View, base: Path | None) -> Table:
    background = _optional(view.background, lambda background: _background(background, base))
    return _without_none({"camera": _camera(view.camera), "clip": _clip(view.clip, base), "background": background})
