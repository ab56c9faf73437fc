"""What was chosen for a clip, and the figure that decided it; and what other qualities would choose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

UNDETERMINED = "undetermined"
"""What is chosen where nothing in the clip or the scene decides it."""

Chosen = TypeVar("Chosen", str, int, tuple[int, int, int], covariant=True)


@dataclass(frozen=True)
class Choice(Generic[Chosen]):
    """One choice.

    Attributes
    ----------
    what
        ``"scattering"``, ``"light strength"``, ``"resolution"``, ``"domain"``, ``"environment directions"``,
        ``"iterations"``, ``"velocity grid coarsening"``, ``"velocity levels"``, ``"axis depth"``, ``"smoke colour"``,
        ``"smoke thickness"``, ``"light direction"``, ``"gain of view 1"`` or ``"fire"``.
    chosen
        What will be used, or `UNDETERMINED`.
    reason
        Why, in a sentence with the figure that decided it.
    measured
        Figures by name, without a unit where the name says none; empty where nothing was measured.
    tolerance
        What the deciding figure was held against.
    by_hand
        Whether the user said so, and nothing was decided.
    """

    what: str
    chosen: Chosen
    reason: str
    measured: Mapping[str, float] = field(default_factory=dict)
    tolerance: float | None = None
    by_hand: bool = False

    def as_dict(self) -> dict[str, Any]:
        """The choice as JSON holds it; figures to four digits, since further ones decide nothing."""
        return {
            "what": self.what,
            "chosen": list(self.chosen) if isinstance(self.chosen, tuple) else self.chosen,
            "reason": self.reason,
            "measured": {name: float(f"{value:.4g}") for name, value in self.measured.items()},
            "tolerance": self.tolerance,
            "by_hand": self.by_hand,
        }


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
