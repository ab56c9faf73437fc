"""What a velocity is estimated from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.checks.array_types import Mask
from smokelift.scene import Side

Density = npt.NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class DensityPair:
    """Two densities, and what is known of the box between them.

    Attributes
    ----------
    before, after : (nx, ny, nz)
        Densities >= 0.
    dt
        Time between them in seconds.
    voxel_size
        Edge of a voxel in metres.
    closed
        Sides of the box that are walls.
    inflow : (nx, ny, nz)
        True where smoke enters; None if that is to be searched for.
    """

    before: Density
    after: Density
    dt: float
    voxel_size: float
    closed: tuple[Side, ...] = ()
    inflow: Mask | None = None
