"""Arguments that are no such thing as a function takes, refused where they are given; and how messages say values."""

from collections.abc import Iterable
from pathlib import Path
from types import UnionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

CODES = (np.uint8, np.uint16)
"""What picture files hold in place of light."""

MAX_MAGNITUDE = 1e12
"""Largest density, velocity or residual: sums of squares of larger ones are not finite in 32 bits."""


def require_kind(
    value: object,
    kinds: type | UnionType | tuple[type, ...],
    name: str,
    expected: str,
    error: type[ValueError] = ValueError,
) -> None:
    """Refuse an argument that is of none of the kinds.

    `name` is that of the argument, `expected` says in words what it must be, and the error of that kind is raised.
    """
    if not isinstance(value, kinds):
        raise error(f"{name} must be {expected}, not {described(value)}.")


def listed(
    values: Any,
    kinds: type | UnionType | tuple[type, ...],
    name: str,
    expected: str,
    error: type[ValueError] = ValueError,
) -> tuple[Any, ...]:
    """Return what a list holds, or raise an error if it is no list, or one of its items is of none of the kinds."""
    require_kind(values, list | tuple, name, expected, error)
    for value in values:
        if not isinstance(value, kinds):
            raise error(f"{name} must be {expected}, but one of them is {described(value)}.")
    return tuple(values)


def numbers(values: Any, name: str, dtype: type[np.floating[Any]] = np.float32) -> NDArray[Any]:
    """Return an array of real numbers; the same one if it is of the type that is wanted.

    A number that the type cannot hold becomes infinite. It raises ValueError, with the name, if it holds anything else,
    or rows of different lengths.
    """
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{name} must be an array of numbers, but its parts differ in shape.") from error
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{name} must be an array of real numbers, not {described(values)}.")
    with np.errstate(over="ignore"):
        return array.astype(dtype, copy=False)


def radiance(values: Any, name: str) -> NDArray[np.float32]:
    """Return a picture as float32; ValueError if it holds no real numbers, or the codes of a picture file.

    Of those nothing would look wrong but the result.
    """
    if getattr(values, "dtype", None) in CODES:
        raise ValueError(f"{name} must be linear radiance, not codes of {values.dtype}; `Clip` reads files as light.")
    return numbers(values, name)


def described(value: object) -> str:
    """Return what was given, in words: itself if it is short, else its kind."""
    if value is None or isinstance(value, bool | int | float | str | np.number):
        return shown(value)
    if isinstance(value, Path):
        return f"the path {value}"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype}"
    kind = type(value).__name__
    return f"{'an' if kind[0] in 'AEIOUaeiou' else 'a'} {kind}"


def counted(number: int, noun: str) -> str:
    """Return so many of something in words: "1 frame", "2 frames"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def one_of(names: Iterable[str]) -> str:
    """Return the values that a key may have, as a message lists them."""
    return ", ".join(f'"{name}"' for name in names)


def printable(text: str) -> str:
    """Return the text with line breaks and the like as their codes, so that it stays one line."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shown(value: object) -> str:
    """Return a value as a scene file would have it, cut to a readable length."""
    if isinstance(value, bool):
        return str(value).lower()
    text = f'"{printable(value)}"' if isinstance(value, str) else repr(value).replace("(", "[").replace(")", "]")
    return text if len(text) <= 60 else text[:57] + "..."
