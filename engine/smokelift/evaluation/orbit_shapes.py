"""How smoke stands along the rays of several azimuths, beside the truth.

Patches are what the method itself matches, from azimuths all around. The shapes are independent of that: they see one
soft body a ray where true smoke has lobes behind one another (docs/experiments/orbit-shapes.md).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy import sparse

from smokelift.checks.array_types import Doubles
from smokelift.density.turntable import Turntable
from smokelift.evaluation.frame_means import finite_mean
from smokelift.evaluation.metrics import RayShapes
from smokelift.render import Volume

SHAPES = ("several_modes", "scatter", "depth_over_width", "row_middles", "ray_length")
"""Figures of `RayShapes`."""

SHAPE_AZIMUTHS = (0, 45, 90, 135)
"""Degrees. Along the rays of 0, the camera's, nothing shows how smoke stands."""

BANDS = 6
"""Bands of equal height, from the floor of the box up, for depth over width."""


class OrbitShapes:
    """Collects the shapes of frames."""

    def __init__(self, table: Turntable) -> None:
        self._table = table
        self._found: list[list[RayShapes | None]] = []

    def add(self, density: Volume) -> None:
        """Add a frame, (nx, ny, nz)."""
        upright = self._table.upright(density)
        self._found.append([RayShapes.of(_turned(upright, self._table, degrees)) for degrees in SHAPE_AZIMUTHS])

    def figures(self, ending: str = "") -> dict[str, Any]:
        """`SHAPES` along the camera's rays, by azimuth, and depth over width by height, their names with an ending."""
        by_azimuth = {name: [_mean(shapes, name) for shapes in zip(*self._found, strict=True)] for name in SHAPES}
        front = [frame[0] for frame in self._found]
        return {
            **{f"{name}{ending}": values[0] for name, values in by_azimuth.items()},
            **{f"{name}{ending}_by_azimuth": values for name, values in by_azimuth.items()},
            f"depth_over_width{ending}_by_height": [
                finite_mean(_band_ratio(shape, band) for shape in front if shape is not None) for band in range(BANDS)
            ],
        }


def _mean(shapes: Iterable[RayShapes | None], name: str) -> float | None:
    return finite_mean(getattr(shape, name) for shape in shapes if shape is not None)


def _band_ratio(shape: RayShapes, band: int) -> float | None:
    """Depth over width in a band of the box; None where it holds no smoke."""
    part = slice(*(len(shape.amounts) * end // BANDS for end in (band, band + 1)))
    depths, widths, amounts = shape.depths[part], shape.widths[part], shape.amounts[part]
    return float(np.average(depths / np.maximum(widths, 1e-9), weights=amounts)) if amounts.any() else None


def _turned(upright: Volume, table: Turntable, degrees: float) -> Volume:
    """Smoke (columns, voxels along the rays of an azimuth, rows), read linearly from an upright volume."""
    counts = upright.shape[:2]
    camera = np.array(table.camera(degrees).matrix)
    axes = [axis for axis in range(3) if axis != table.axis]
    right, ray = camera[axes, 0], -camera[axes, 2]
    # voxels stay where they are as the box is turned by quarters
    reach = [(np.abs(direction) @ counts - 1) / 2 for direction in (right, ray)]
    across, along = (np.arange(-each, each + 0.5) for each in reach)
    places = across[:, None, None] * right + along[:, None] * ray + (np.array(counts) - 1) / 2
    read = _linear(places.reshape(-1, 2), (counts[0], counts[1]))
    turned = read @ upright.reshape(-1, upright.shape[2])
    return np.asarray(turned, np.float32).reshape(len(across), len(along), -1)


def _linear(places: Doubles, counts: tuple[int, int]) -> sparse.csr_array:
    """Weights (places, grid points) of a linear interpolation; what is outside the grid is zero."""
    low = np.floor(places + 1e-6).astype(int)
    fraction = places - low
    rows, columns, weights = [], [], []
    for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
        at = low + corner
        weight = np.prod(np.where(corner, fraction, 1 - fraction), axis=1)
        inside = ((at >= 0) & (at < counts)).all(1) & (weight > 1e-6)
        rows.append(np.flatnonzero(inside))
        columns.append(at[inside] @ (counts[1], 1))
        weights.append(weight[inside])
    found = np.concatenate(weights).astype(np.float32), (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_array(found, shape=(len(places), counts[0] * counts[1]))
