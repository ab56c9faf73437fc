"""Where in depth the smoke stands: the axis that depth profiles are centred on, and how well it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from smokelift.density.screen import reach_along, view_frame
from smokelift.scene import Camera, Domain


@dataclass(frozen=True, eq=False)
class Column:
    """One of several columns of smoke, by height.

    Attributes
    ----------
    begins
        Height (m above the domain's centre) of its lower end.
    middles, widths, depths : (n,)
        Lateral place of its axis, lateral standard deviation and depth, in metres, at the heights of its `SmokeAxis`.
    """

    begins: float
    middles: NDArray[np.float64]
    widths: NDArray[np.float64]
    depths: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SmokeAxis:
    """How far behind the domain's centre the middle of the smoke is, by height, and by column where there are several.

    Attributes
    ----------
    heights : (n,)
        In metres above the domain's centre, ascending, along `view_frame`'s height.
    depths : (n,)
        In metres along `view_frame`'s depth, away from the camera.
    spreads : (n,)
        Standard deviation (m) about it of several columns that are known to stand behind one another.
    columns
        Known columns, if there are several. Beside one another they have depths of their own.
    """

    heights: NDArray[np.float64]
    depths: NDArray[np.float64]
    spreads: NDArray[np.float64]
    columns: tuple[Column, ...] = ()

    @staticmethod
    def upright(depth: float = 0.0) -> SmokeAxis:
        """The same depth at all heights."""
        return SmokeAxis(np.zeros(1), np.full(1, float(depth)), np.zeros(1))

    @staticmethod
    def given(depth: float, camera: Camera, domain: Domain) -> SmokeAxis:
        """A depth that is known, at all heights.

        Raises
        ------
        ValueError
            If it is outside the domain.
        """
        reach = reach_along(domain, view_frame(camera)[1])
        if abs(depth) >= reach:
            raise ValueError(
                f"The axis depth {depth:g} m is outside the box, which reaches {reach:.3g} m before and behind its "
                "middle; give a number between."
            )
        return SmokeAxis.upright(depth)

    def at(self, heights: NDArray[np.float64], laterals: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Depths at some heights, and lateral places if it is not to be the mean over the columns."""
        if not self.columns or laterals is None:
            return np.asarray(np.interp(heights, self.heights, self.depths))
        return self._mean([column.depths for column in self.columns], heights, laterals)

    def spread_at(
        self, heights: NDArray[np.float64], laterals: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Spreads at some heights, and lateral places."""
        if not self.columns or laterals is None:
            return np.asarray(np.interp(heights, self.heights, self.spreads))
        square = self._mean([column.depths**2 for column in self.columns], heights, laterals)
        return np.asarray(np.sqrt(np.maximum(square - self.at(heights, laterals) ** 2, 0)))

    def width_at(self, heights: NDArray[np.float64], laterals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Lateral standard deviation (m) of the columns at some heights and lateral places."""
        return self._mean([column.widths for column in self.columns], heights, laterals)

    def _mean(
        self, values: Sequence[NDArray[np.float64]], heights: NDArray[np.float64], laterals: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Mean over the columns that may hold the smoke at some places."""
        total, shares = np.zeros(np.shape(heights)), np.zeros(np.shape(heights))
        for column, value in zip(self.columns, values, strict=True):
            middle, width = (np.interp(heights, self.heights, of) for of in (column.middles, column.widths))
            share = likelihood(laterals, middle, width) * (heights >= column.begins)
            total += share * np.interp(heights, self.heights, value)
            shares += share
        lowest = min(range(len(values)), key=lambda k: self.columns[k].begins)
        below = np.interp(heights, self.heights, values[lowest])
        return np.where(shares > 0, total / np.maximum(shares, 1e-30), below)


def likelihood(
    places: NDArray[np.float64], middles: NDArray[np.float64], widths: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How likely smoke at some lateral places belongs to columns; never quite impossible."""
    return np.asarray(np.exp(-(((places - middles) / widths) ** 2) / 2) + 1e-9)


Cue = Literal["box", "floor contact", "inlets", "lamps"]
"""What tells where the smoke stands; the box alone leaves it undetermined."""


@dataclass(frozen=True, eq=False)
class AxisEstimate:
    """An axis, and how well it is known.

    Attributes
    ----------
    axis
        The most likely one.
    cue
        What tells it.
    depth
        Mean depth (m behind the domain's centre) of smoke that stands on it.
    deviation
        Standard deviation (m) of the mean depth's error.
    """

    axis: SmokeAxis
    cue: Cue
    depth: float
    deviation: float
