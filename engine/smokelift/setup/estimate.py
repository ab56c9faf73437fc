"""What was decided for a clip, by what, and how well it is known; and what other qualities would take."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from smokelift.checks import Figures, Remark

UNDETERMINED = "undetermined"
"""Value of an estimate that nothing in the clip or the scene decides."""

Value = TypeVar("Value", str, int, tuple[int, int, int], covariant=True)


@dataclass(frozen=True, kw_only=True)
class Estimate(Remark, Generic[Value]):
    """One decision; its kind says what decided it, its figures are what was measured for it. See the functions below.

    Attributes
    ----------
    what
        ``"scattering"``, ``"resolution"``,
        ``"velocity grid coarsening"``, ``"axis depth"``, ``"smoke colour"``, ``"smoke thickness"``,
        ``"gain of view 1"`` or ``"fire"``.
    value
        What will be used, or `UNDETERMINED`.
    source
        The user gives it, the clip shows it, or nothing decides it and it is assumed.
    spread
        Standard deviation of what was measured: metres of an axis depth, a share of a smoke thickness; None of others.
    tolerance
        What the deciding figure was held against.
    """

    what: str
    value: Value
    source: Literal["given", "measured", "assumed"]
    spread: float | None = None
    tolerance: float | None = None


def given(what: str, value: Value) -> Estimate[Value]:
    """Return what the user decides."""
    return Estimate("given", what=what, value=value, source="given")


def measured(
    kind: str,
    value: Value,
    figures: Figures,
    *,
    what: str = "",
    spread: float | None = None,
    tolerance: float | None = None,
) -> Estimate[Value]:
    """Return what the clip shows; without more ado its kind is what it is about."""
    about = what or kind
    return Estimate(kind, figures, what=about, value=value, source="measured", spread=spread, tolerance=tolerance)


def undetermined(
    kind: str,
    what: str,
    figures: Figures | None = None,
    *,
    spread: float | None = None,
    tolerance: float | None = None,
) -> Estimate[str]:
    """Return what neither the user decides nor the clip shows well enough."""
    unknown, known = UNDETERMINED, figures or {}
    return Estimate(kind, known, what=what, value=unknown, source="assumed", spread=spread, tolerance=tolerance)


@dataclass(frozen=True)
class Grid:
    """The grid that a quality takes of a clip.

    Attributes
    ----------
    resolution
        Voxels along x, y, z.
    lost
        Share of the smoke's contrast in the clip that is finer than it shows; None where that was not measured.
    """

    resolution: tuple[int, int, int]
    lost: float | None
