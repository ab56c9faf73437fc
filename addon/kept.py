"""Values that follow the newest result until the artist changes them."""

from typing import Any

import bpy
from mathutils import Matrix

TOLERANCE = 1e-5
"""Difference, relative to the value above 1, that rounding in Blender's 32-bit numbers may make."""


def set_unless_changed(owner: bpy.types.ID, name: str, holder: Any, attribute: str, value: Any) -> None:
    """Set a value for the first time, or again if it is still as it was set last.

    Parameters
    ----------
    owner
        Data-block that remembers what was set, in the custom property ``smokelift_NAME``.
    name
        Of the value among those of the owner.
    holder, attribute
        Where Blender keeps the value: a number, a vector or a matrix.
    value
        The value.
    """
    before = owner.get(_key(name))
    if before is None or _same(_numbers(getattr(holder, attribute)), list(before)):
        set_and_remember(owner, name, holder, attribute, value)


def set_and_remember(owner: bpy.types.ID, name: str, holder: Any, attribute: str, value: Any) -> None:
    """Set a value, whatever it is, so that it follows the newest result from now on; parameters as above."""
    setattr(holder, attribute, value)
    owner[_key(name)] = _numbers(getattr(holder, attribute))


def _key(name: str) -> str:
    return f"smokelift_{name}"


def _numbers(value: Any) -> list[float]:
    if isinstance(value, Matrix):
        return [number for row in value for number in row]
    return [float(number) for number in value] if hasattr(value, "__len__") else [float(value)]


def _same(found: list[float], set_last: list[float]) -> bool:
    return len(found) == len(set_last) and all(
        abs(a - b) <= TOLERANCE * max(1.0, abs(b)) for a, b in zip(found, set_last, strict=True)
    )
