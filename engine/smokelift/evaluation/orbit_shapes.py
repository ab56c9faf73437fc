"""How smoke stands along the rays of several azimuths, beside the truth.

Patches are what the method itself matches, from azimuths all around. The shapes are independent of that: they see one
soft body a ray where true smoke has lobes behind one another (docs/experiments/orbit-shapes.md).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy import ndimage

from smokelift.density.turntable import Turntable
from smokelift.evaluation.frame_means import finite_mean
from smokelift.evaluation.metrics import RayShapes
from smokelift.render import Volume

SHAPES = ("several_modes", "scatter", "depth_over_width", "row_middles", "ray_length")
"""Figures of `RayShapes`."""

SHAPE_AZIMUTHS = (0, 45, 90, 135)
"""Azimuths (degrees) of the rays. Along those of 0, the camera's, nothing shows how smoke stands."""

BANDS = 6
"""Bands of equal height, from the floor of the box up, for depth over width."""


def azimuth_shapes(table: Turntable, density: Volume) -> list[RayShapes | None]:
    """Shapes of a frame's smoke (nx, ny, nz) along the rays of `SHAPE_AZIMUTHS`; None where there is none."""
    upright = table.upright(density)
    return [RayShapes.of(_turned(upright, table, degrees)) for degrees in SHAPE_AZIMUTHS]


def shape_means(frames: Iterable[list[RayShapes | None]], ending: str = "") -> dict[str, Any]:
    """`SHAPES` along the camera's rays, by azimuth, and depth over width by height: means, their names with an ending.

    The frames are `azimuth_shapes`.
    """
    azimuths = list(zip(*frames, strict=True))
    by_azimuth = {name: [_mean(shapes, name) for shapes in azimuths] for name in SHAPES}
    front = [shape for shape in azimuths[0] if shape is not None]
    return {
        **{f"{name}{ending}": values[0] for name, values in by_azimuth.items()},
        **{f"{name}{ending}_by_azimuth": values for name, values in by_azimuth.items()},
        f"depth_over_width{ending}_by_height": [
            finite_mean(_band_ratio(shape, band) for shape in front) for band in range(BANDS)
        ],
    }


def _mean(shapes: Iterable[RayShapes | None], name: str) -> float | None:
    return finite_mean(getattr(shape, name) for shape in shapes if shape is not None)


def _band_ratio(shape: RayShapes, band: int) -> float | None:
    """Depth over width in a band of the box; None where it holds no smoke."""
    part = slice(*(len(shape.masses) * end // BANDS for end in (band, band + 1)))
    depths, widths, masses = shape.depths[part], shape.widths[part], shape.masses[part]
    return float(np.average(depths / np.maximum(widths, 1e-9), weights=masses)) if masses.any() else None


def _turned(upright: Volume, table: Turntable, degrees: float) -> Volume:
    """Smoke (columns, voxels along the rays of an azimuth, rows), read linearly from an upright volume."""
    camera = np.array(table.camera(degrees).matrix)
    axes = [axis for axis in range(3) if axis != table.axis]
    turn = np.eye(3)
    turn[:2, :2] = np.stack([camera[axes, 0], -camera[axes, 2]], -1)
    # voxels stay where they are as the box is turned by quarters
    sizes = np.abs(turn).T @ upright.shape
    offset = (np.array(upright.shape) - 1) / 2 - turn @ (sizes - 1) / 2
    shape = tuple(np.ceil(sizes - 0.5).astype(int).tolist())
    return np.asarray(ndimage.affine_transform(upright, turn, offset, shape, order=1, mode="grid-constant"))
