"""The smoke of some frames by height: how much, how far aside, and what its depth at the base says of that above."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from smokelift.density.screen import Upright, reach_along, view_frame
from smokelift.scene import Camera, Domain

NEAR_SIDE = 0.3, 0.45
"""Distances from the axis, in reaches, of the place where smoke begins. Between them the assumption fades in that it
leans to the other side, so that its mean is on the axis; beyond the second it holds fully: a box is around its smoke
(docs/experiments/density-axis.md)."""


@dataclass(frozen=True, eq=False)
class SmokeRows:
    """The smoke of some frames by height.

    Attributes
    ----------
    rows
        Of each frame that shows smoke, one at least; all have the same heights.
    camera
        A camera that stands still.
    domain
        The box.
    """

    rows: tuple[Upright, ...]
    camera: Camera
    domain: Domain

    @property
    def heights(self) -> NDArray[np.float64]:
        """Heights in metres above the domain's centre, ascending, along `view_frame`'s height, (n,)."""
        return self.rows[0].heights

    @cached_property
    def total(self) -> NDArray[np.float64]:
        """Smoke at each height, over all frames, (n,)."""
        return np.asarray(np.sum([row.total for row in self.rows], 0))

    @cached_property
    def middle(self) -> NDArray[np.float64]:
        """Mean lateral position (m) of the smoke at each height, over all frames, (n,)."""
        known = self.total > 0.02 * self.total.max()
        mean = np.sum([row.total * row.mean for row in self.rows], 0)[known] / self.total[known]
        return np.asarray(np.interp(self.heights, self.heights[known], mean))

    @cached_property
    def reach(self) -> float:
        """Half the domain's depth (m)."""
        return reach_along(self.domain, view_frame(self.camera)[1])

    def mean(self, values: NDArray[np.float64]) -> float:
        """Mean of values (n,) by height over the smoke."""
        return float(np.average(values, weights=self.total))

    def risen(self, depth: NDArray[np.float64], across: NDArray[np.float64]) -> NDArray[np.float64]:
        """The likely depth (n,) at each height of smoke that begins at a depth and a lateral position, (n,) each."""
        raised = np.cumsum(self.total) / self.total.sum()  # 1/2 in the smoke's mean
        low, high = NEAR_SIDE
        leaning = np.clip((np.abs(depth) / self.reach - low) / (high - low), 0, 1)
        # what drifts across the picture drifts in depth as well, nobody knows where to
        drift = (self.middle - across) / np.maximum(np.abs(depth), self.domain.voxel_size)
        return np.asarray(depth * (1 - 2 * leaning * raised) / (1 + drift**2))
