"""Every key of a scene file, as tables in Markdown, from the dataclasses that a scene file is read into.

python tools/scene_reference.py        # prints what the manual's page "Scene file" ends with
"""

import inspect
import re
import sys
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from smokelift.checks import shown
from smokelift.scene import Background, ClipSource, Domain, Inlet, Medium, Scene, View
from smokelift.scene.lights import LIGHT_TYPES

Row = tuple[str, str, str, str]
"""Key, what it holds, default, meaning."""

REQUIRED = "required"
OPEN = "-"

CAMERA: Mapping[str, Row] = {
    row[0]: row
    for row in (
        ("type", '`"perspective"`, `"orthographic"`', '`"perspective"`', "Kind of lens."),
        ("size", "two whole numbers", REQUIRED, "Width and height of the picture in pixels, in the clip's shape."),
        ("position", "three numbers", REQUIRED + ", or `matrix`, or `matrices`", "Where the camera is, in meters."),
        ("target", "three numbers", REQUIRED + " with `position`", "The point in meters that it looks at."),
        ("up", "three numbers", "`[0.0, 0.0, 1.0]`", "A direction that is up in the picture; with `position`."),
        ("matrix", "four rows of four numbers", OPEN, "Camera to world, rigid, in place of `position` and `target`."),
        ("matrices", "list of such matrices", OPEN, "One for every frame that is used, of a camera that moves."),
        ("fov_y_degrees", "number", REQUIRED + ", or `fx`", "Perspective: angle from the lower to the upper edge."),
        ("height", "number", REQUIRED + ", or `fx`", "Orthographic: height of the picture in meters."),
        ("fx", "number", OPEN, "Focal length in pixels; orthographic: pixels per meter."),
        ("fy", "number", "`fx`", "The same along the picture's height."),
        ("cx", "number", "half of the width", "Where the optical axis meets the picture, in pixels from the left."),
        ("cy", "number", "half of the height", "The same from the top."),
    )
}
"""Keys of a camera, which are no fields: several of them describe one matrix and one lens."""


def tables() -> dict[str, tuple[str, list[Row]]]:
    """Return what stands under each header of a scene file: a sentence, and a row for each key."""
    of_scene = {row[0]: row for row in rows(Scene)}
    of_box = {row[0]: row for row in rows(Domain)}
    of_box["resolution"] = (*of_box["resolution"][:2], "by the quality", of_box["resolution"][3])
    found = {
        "[clip]": (summary(ClipSource), rows(ClipSource)),
        "[camera]": ("The camera that filmed the clip; estimated if it is left out.", list(CAMERA.values())),
        "[domain]": (summary(Domain), [*of_box.values(), of_scene["closed"]]),
        "[[inlet]]": (summary(Inlet), rows(Inlet)),
        "[medium]": (summary(Medium), [*rows(Medium), of_scene["scattering"]]),
        "[background]": (summary(Background), rows(Background)),
    }
    for name, light in LIGHT_TYPES.items():
        found[f'[[lights]] of type "{name}"'] = (summary(light), rows(light))
    parts = {"camera": "[camera]", "clip": "[clip]", "background": "[background]"}
    views = [(row[0], f"a table as `{parts[row[0]]}`", row[2], row[3]) for row in rows(View)]
    found["[[views]]"] = (summary(View), views)
    return found


def markdown() -> str:
    """Return the tables as Markdown."""
    parts = []
    for header, (sentence, listed) in tables().items():
        lines = [
            f"### `{header}`",
            "",
            sentence,
            "",
            "| key | holds | default | meaning |",
            "| --- | --- | --- | --- |",
        ]
        lines += ["| " + " | ".join((f"`{row[0]}`", *row[1:])) + " |" for row in listed]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def rows(kind: type[Any]) -> list[Row]:
    """Return a row for each field of a dataclass.

    Raises
    ------
    KeyError
        If the class's docstring has no text for a field under *Attributes*.
    """
    meanings, hints = attributes(kind), get_type_hints(kind)
    return [(each.name, _holds(hints[each.name]), _default(each.default), meanings[each.name]) for each in fields(kind)]


def summary(kind: type[Any]) -> str:
    """Return the first paragraph of a class's docstring."""
    return " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split())


def attributes(kind: type[Any]) -> dict[str, str]:
    """Return the meaning of each field from the section *Attributes* of a docstring in NumPy's style."""
    _, _, section = (inspect.getdoc(kind) or "").partition("Attributes\n----------\n")
    section = re.split(r"\n\n\w[^\n]*\n-+\n", section)[0]
    found: dict[str, str] = {}
    for names, text in re.findall(r"^(\w[\w, ]*)\n((?:    .*\n?|\n)+)", section + "\n", re.MULTILINE):
        meaning = re.sub(r"\bNone\b", "leaving it out", " ".join(text.split()).replace("``", "`"))
        found |= {name.strip(): meaning for name in names.split(",")}
    return found


def _holds(hint: Any) -> str:
    """Return in words what a value of a type is in a TOML file."""
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(_holds(part) for part in get_args(hint) if part is not NoneType)
    if get_origin(hint) is Literal:
        return ", ".join(f'`"{value}"`' for value in get_args(hint))
    if get_origin(hint) is tuple:
        parts = get_args(hint)
        if parts[-1] is Ellipsis:
            item = _holds(parts[0])
            return f"list of {item}s" if parts[0] is int else f"list of {item}"
        return f"{('no', 'one', 'two', 'three')[len(parts)]} {_holds(parts[0])}s"
    return {float: "number", int: "whole number", Path: "path", str: "text"}.get(hint, getattr(hint, "__name__", ""))


def _default(value: Any) -> str:
    """Return a field's default as a scene file would have it."""
    if value is MISSING:
        return REQUIRED
    return OPEN if value in (None, ()) else f"`{shown(value)}`"


if __name__ == "__main__":
    sys.stdout.write(markdown() + "\n")
