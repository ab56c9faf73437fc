"""Decisions about a clip, with what decided them; and the grids of qualities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from smokelift.checks import Remark

UNDETERMINED = "undetermined"
"""Value of an estimate that nothing in the clip or the scene decides."""

Value = TypeVar("Value", str, int, tuple[int, int, int], covariant=True)


@dataclass(frozen=True, kw_only=True)
class Estimate(Remark, Generic[Value]):
    """One decision; its kind says what decided it, its figures are what was measured for it.

    Attributes
    ----------
    what
        ``"scattering"``, ``"resolution"``, ``"velocity grid coarsening"``, ``"axis depth"``, ``"smoke colour"``,
        ``"source radiance"``, ``"gain of view 1"`` or ``"fire"``.
    value
        What will be used, or `UNDETERMINED`.
    source
        The user gives it, the clip shows it, or nothing decides it and it is assumed.
    spread
        Standard deviation: metres of an axis depth, None of others.
    tolerance
        What the deciding figure was compared with.
    """

    what: str
    value: Value
    source: Literal["given", "measured", "assumed"]
    spread: float | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class Grid:
    """The voxels (x, y, z) that a quality takes for a clip.

    ``lost`` is the share of the smoke's contrast that is finer than they show; None where that was not measured.
    """

    resolution: tuple[int, int, int]
    lost: float | None
