"""What every package says of a value that it is given, and the kind and figures of what it finds of a shot or a result.

Arguments that are no such thing as a function takes are refused where they are given, in the same words everywhere;
those for findings are in `smokelift.report`. Types of arrays say what these hold; shapes and units stand where they are
used.
"""

from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from types import UnionType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
"""Single precision: densities, velocities, radiance."""

Doubles = NDArray[np.float64]
"""Double precision: places, directions, sums."""

Mask = NDArray[np.bool_]
"""Whether something holds of a pixel or a voxel."""

Indices = NDArray[np.intp]
"""Places in other arrays."""

Figure = float | str | tuple[float, ...]
"""What a sentence fills in."""

Figures = Mapping[str, Figure]

Source = Literal["given", "measured", "estimated", "assumed", "made up"]

UNDETERMINED = "undetermined"
"""Value of a choice that nothing in the clip or the scene decides."""

CODES = (np.uint8, np.uint16)
"""What picture files hold in place of light."""

MAX_MAGNITUDE = 1e12
"""Largest density, velocity or residual: sums of squares of larger ones are not finite in 32 bits."""


@dataclass(frozen=True)
class Finding:
    """Something that was given, measured, assumed or noticed."""

    kind: str
    """Name of its words."""
    figures: Figures = field(default_factory=dict)
    """What the words fill in, by name. ``view`` is the number of the further view that it is about, ``tolerance`` what
    the deciding figure of a choice was compared with."""
    _: KW_ONLY
    about: str = ""
    """What it decides or explains, such as ``"background"`` or ``"scattering"``; empty of what is only noticed."""
    value: Figure | None = None
    """What a choice takes, or `UNDETERMINED`; None where nothing was chosen."""
    source: Source | None = None
    """The user gives it, the pictures show it (``"measured"``), or it follows from what they show (``"estimated"``).
    The pictures leave the others undetermined: ``"assumed"`` is one answer for all clips, ``"made up"`` one of many for
    this one. None of what is only noticed."""
    spread: float | None = None
    """Standard deviation of the value: meters of a depth; None if it is unknown."""
    doubt: bool = False
    """Whether it says why the result may be nothing, or wrong."""


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


def densities(
    values: Any, name: str, shape: tuple[int, ...] | None = None, largest: float = MAX_MAGNITUDE
) -> NDArray[np.float32]:
    """Return densities (nx, ny, nz), of a shape if one is given, as float32 in one piece.

    It raises ValueError, with the name, if they have another shape, are not finite, or not from 0 to ``largest``.
    """
    array = numbers(values, name)
    if array.ndim != 3 or 0 in array.shape or shape not in (None, array.shape):
        expected = "be three-dimensional" if shape is None else f"have the shape {shape}"
        raise ValueError(f"{name} must {expected}, not of shape {array.shape}; resample it.")
    least, most = array.min(), array.max()  # NaN if any is
    if not np.isfinite((least, most)).all():
        raise ValueError(f"{name} holds densities that are not finite; set them to 0.")
    if least < 0:
        raise ValueError(f"{name} holds negative densities; set them to 0.")
    if most > largest:
        raise ValueError(f"{name} holds densities up to {most:g}; scale them to {largest:g} at most.")
    return np.ascontiguousarray(array)


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
