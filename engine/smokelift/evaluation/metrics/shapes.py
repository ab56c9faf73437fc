"""Shapes of smoke along rays: how it stands in depth, whatever its texture.

Lengths are in units of the smoke's width: its standard deviation across its rows, the mean over the smoke.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from smokelift.checks import Doubles
from smokelift.evaluation.metrics.errors import finite_array

PART_FRACTION = 0.2
"""Fraction of a ray's largest density from which on its smoke is in a part of it."""

MODE_FRACTION = 0.1
"""Fraction of the smoke of a ray's parts from which on its second largest part counts as another mode."""

FAINT_RAY, FAINT_ROW = 0.1, 0.02
"""Fractions of the smoke of a usual ray (the ninth decile) and of the largest row, below which one does not count."""


@dataclass(frozen=True, eq=False)
class RayShapes:
    """The shape of one frame's smoke along parallel level rays; all means count by smoke.

    Attributes
    ----------
    several_modes
        Fraction of the smoke on rays that meet several lobes, with a gap between them.
    scatter
        Standard deviation of the rays' middles about the middle of their row, over the row's standard deviation along
        the rays: 0 where smoke is symmetric about an upright plane, 1 where each ray is short.
    depth_over_width
        Standard deviation of the rows along the rays over that across.
    row_middles
        Standard deviation along the rays of the rows' middles, over the smoke's width.
    ray_length
        Effective length of rays, (sum rho)^2 / sum rho^2, over the smoke's width.
    depths, widths, masses : (n,)
        Of the rows, from below: standard deviations along the rays and across (voxels), and how much smoke they hold.
    """

    several_modes: float
    scatter: float
    depth_over_width: float
    row_middles: float
    ray_length: float
    depths: Doubles
    widths: Doubles
    masses: Doubles

    @staticmethod
    def of(smoke: npt.ArrayLike) -> "RayShapes | None":
        """Measure smoke (columns, voxels along the rays, rows); None where there is none."""
        values = np.maximum(finite_array(smoke), 0)
        amount = values.sum(1)
        if not amount.any():
            return None
        across, along = (np.arange(n, dtype=np.float64) for n in values.shape[:2])
        rows = amount.sum(0)
        counts = np.where(rows > FAINT_ROW * rows.max(), rows, 0)
        safe, rays = np.maximum(rows, 1e-30), np.maximum(amount, 1e-30)
        middle = np.einsum("xyz,y->xz", values, along)
        row_middle = middle.sum(0) / safe
        middle /= rays
        depths = np.sqrt(np.einsum("yz,yz->z", values.sum(0), (along[:, None] - row_middle) ** 2) / safe)
        row_place = across @ amount / safe
        widths = np.sqrt(np.einsum("xz,xz->z", amount, (across[:, None] - row_place) ** 2) / safe)
        spread = np.sqrt(np.einsum("xz,xz->z", amount, (middle - row_middle) ** 2) / safe)
        width = max(float(np.average(widths, weights=counts)), 1e-9)
        mean = np.average(row_middle, weights=counts)
        thick = np.where(amount > FAINT_RAY * np.quantile(amount[amount > 0], 0.9), amount, 0)
        lengths = amount**2 / np.maximum(np.einsum("xyz,xyz->xz", values, values), 1e-30)
        several = _several_modes(np.moveaxis(values, 1, 2))
        return RayShapes(
            several_modes=float(np.average(several, weights=thick)),
            scatter=float(np.average(spread / np.maximum(depths, 1e-9), weights=counts)),
            depth_over_width=float(np.average(depths / np.maximum(widths, 1e-9), weights=counts)),
            row_middles=float(np.sqrt(np.average((row_middle - mean) ** 2, weights=counts))) / width,
            ray_length=float(np.average(lengths, weights=thick)) / width,
            depths=depths,
            widths=widths,
            masses=counts,
        )


def _several_modes(rays: Doubles) -> npt.NDArray[np.bool_]:
    """Whether rays (columns, rows, voxels) have a second part that counts."""
    inside = rays > PART_FRACTION * rays.max(-1, keepdims=True)
    starts = inside.copy()
    starts[..., 1:] &= ~inside[..., :-1]
    # parts are numbered along the rays, one ray after the other
    number = np.cumsum(starts).reshape(starts.shape) - 1
    masses = np.bincount(number[inside], rays[inside])
    ray = np.flatnonzero(starts) // rays.shape[-1]
    order = np.lexsort((-masses, ray))
    ray, masses = ray[order], masses[order]
    first = np.concatenate([[True], ray[1:] != ray[:-1]])
    second = ~first & np.concatenate([[False], first[:-1]])
    total = np.bincount(ray, masses, minlength=inside[..., 0].size)
    found = np.zeros(total.shape)
    found[ray[second]] = masses[second]
    return np.asarray(found > MODE_FRACTION * total).reshape(inside.shape[:-1])
