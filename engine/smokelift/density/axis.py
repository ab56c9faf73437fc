"""The axis that depth profiles are centered on, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from smokelift.checks.array_types import Doubles
from smokelift.density.upright_plane import reach_along, read_linearly, view_frame
from smokelift.scene import Camera, Domain


@dataclass(frozen=True, eq=False)
class SmokeAxis:
    """How far behind the domain's center the middle of the smoke is, on the upright plane through the center.

    Attributes
    ----------
    heights : (n,)
        Meters above the center, ascending, along `view_frame`'s height.
    laterals : (m,)
        Meters from the center, ascending, along its lateral direction; one where there is one column.
    depths : (n, m)
        Meters away from the camera, along its depth direction.
    spreads : (n, m)
        Standard deviation (m) of the depth over the columns that stand behind one another.
    widths : (n, m)
        Lateral standard deviation (m) of the column that shows there, if there are several; else zero.
    """

    heights: Doubles
    laterals: Doubles
    depths: Doubles
    spreads: Doubles
    widths: Doubles

    @staticmethod
    def by_height(heights: Doubles, depths: Doubles) -> SmokeAxis:
        """One column, whose depth (n,) depends on the height (n,) alone."""
        nothing = np.zeros((len(depths), 1))
        return SmokeAxis(heights, np.zeros(1), np.reshape(depths, (-1, 1)), nothing, nothing)

    @staticmethod
    def upright(depth: float = 0.0) -> SmokeAxis:
        """One column of the same depth (m) at all heights."""
        return SmokeAxis.by_height(np.zeros(1), np.full(1, float(depth)))

    @property
    def several(self) -> bool:
        """Whether several columns are known."""
        return len(self.laterals) > 1

    def at(self, heights: Doubles, laterals: Doubles | float = 0.0) -> Doubles:
        """Depths at some heights and lateral places."""
        return self.read(self.depths, heights, laterals)

    def read(self, values: Doubles, heights: Doubles, laterals: Doubles | float) -> Doubles:
        """Depths, spreads or widths (n, m) at some heights and lateral places."""
        return read_linearly(values, self.heights, self.laterals, heights, laterals)


def depth_at(distance: float, camera: Camera, domain: Domain) -> float:
    """Depth (m behind the domain's center) of what stands at a level distance (m) ahead of a camera.

    It raises ValueError outside the domain.
    """
    along = view_frame(camera)[1]
    middle = float((np.array(domain.centre) - np.array(camera.position)) @ along)
    reach = reach_along(domain, along)
    if abs(distance - middle) >= reach:
        raise ValueError(
            f"The distance {distance:g} m is outside the box, which reaches from {middle - reach:.3g} to "
            f"{middle + reach:.3g} m ahead of the camera; give a number between."
        )
    return distance - middle


Cue = Literal["box", "floor contact", "inlets", "distance"]
"""What shows where the smoke stands; the box alone leaves it undetermined."""


@dataclass(frozen=True, eq=False)
class AxisEstimate:
    """An axis, the cue that shows it, and how well it is known.

    `axis` is the likeliest, `depth` the mean depth (m behind the domain's center) of smoke that stands on it, and
    `deviation` the standard deviation (m) of that depth's error.
    """

    axis: SmokeAxis
    cue: Cue
    depth: float
    deviation: float
