"""Checks of the values in a scene: what is refused, and in which words."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.checks import described, shown

Vector = tuple[float, float, float]
"""x, y, z or red, green, blue."""

LARGEST, SMALLEST = 1e9, 1e-9
"""No number of a scene is larger, and none that must be above 0 is smaller: what is computed of a few of them stays a
normal number of 32 bits."""

ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:[/\\]")
"""Begins the address of a file on a network; in a path of Windows / is \\, and a drive has one letter."""


class SceneError(ValueError):
    """A scene that cannot be used: what was expected, and what was found.

    In a scene file the value would stand under ``key`` of ``table``; each is empty when unknown.
    """

    def __init__(self, message: str, *, key: str = "", table: str = "") -> None:
        super().__init__(message)
        self.key = key
        self.table = table


def unexpected(value: object, key: str, expected: str, table: str = "") -> SceneError:
    """Return the error that says what was expected under ``key`` and what was found."""
    return SceneError(f"{key} must be {expected}, not {shown(value)}", key=key, table=table)


def number(value: Any, key: str, expected: str = "a number", valid: Callable[[float], bool] = math.isfinite) -> float:
    """Return ``value`` as a float that is ``valid``, of a magnitude up to `LARGEST`; or raise a SceneError."""
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        magnitude: Any = abs(value)
        if magnitude <= LARGEST:  # an int of 400 digits is no float
            if valid(float(value)):
                return float(value)
        elif magnitude < math.inf:
            expected += f", {LARGEST:g} at most"
    raise unexpected(value, key, expected)


def positive(value: Any, key: str, expected: str = "a number above 0") -> float:
    """Return ``value`` as a float from `SMALLEST` to `LARGEST`, or raise a SceneError that names ``key``."""
    result = number(value, key, expected, lambda v: v > 0.0)
    if result < SMALLEST:
        raise unexpected(value, key, f"{expected}, {SMALLEST:g} at least")
    return result


def integer(
    value: Any, key: str, expected: str = "a whole number", least: int = -int(LARGEST), most: int = int(LARGEST)
) -> int:
    """Return ``value`` as an int from ``least`` to ``most``, or raise a SceneError that names ``key``."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool) and least <= value <= most:
        return int(value)
    raise unexpected(value, key, expected)


def items(value: Any, count: int, key: str, expected: str) -> list[Any]:
    """Return ``value`` as a list of ``count`` items, or raise a SceneError that names ``key``."""
    listed = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(listed, list | tuple) or len(listed) != count:
        raise unexpected(listed, key, expected)
    return list(listed)


def vector(value: Any, key: str, expected: str = "three numbers [x, y, z]") -> Vector:
    """Return ``value`` as three finite floats, or raise a SceneError that names ``key``."""
    x, y, z = (number(v, key, expected) for v in items(value, 3, key, expected))
    return x, y, z


def color(value: Any, key: str) -> Vector:
    """Return ``value`` as linear red, green and blue, or raise a SceneError that names ``key``."""
    expected = "three numbers [r, g, b], none below 0"
    rgb = vector(value, key, expected)
    if min(rgb) < 0.0:
        raise unexpected(list(rgb), key, expected)
    return rgb


def set_fields(instance: object, **values: object) -> None:
    """Set fields of a frozen dataclass; for its ``__post_init__`` only."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def check_given(instance: object, **checks: Callable[[Any, str], object]) -> None:
    """Set those fields of a frozen dataclass that are not None to what a function makes of the value and the name."""
    for name, check in checks.items():
        if (value := getattr(instance, name)) is not None:
            set_fields(instance, **{name: check(value, name)})


def file_path(value: Any, key: str, expected: str = "the path of a file") -> Path:
    """Return ``value`` as a path, or raise a SceneError that names ``key``."""
    if not isinstance(value, str | Path) or not str(value):
        raise SceneError(f"{key} must be {expected}, not {described(value)}", key=key)
    path = Path(value)
    if ADDRESS.match(str(value)) and not Path(path.parts[0]).exists():  # a folder may be called "http:"
        raise SceneError(
            f"{shown(str(value))} is an address; save the file on this computer and give its path", key=key
        )
    return path
