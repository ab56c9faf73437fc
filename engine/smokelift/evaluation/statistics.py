"""What pictures and volumes of smoke are like without a truth beside them: texture by patches, shapes along rays."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from smokelift.checks import Doubles, numbers
from smokelift.transport import StaggeredGrid, block_means

PATCH = 7
"""Pixels along a patch: the finest structure with its surroundings; a patch of scale 4 spans a lobe."""

SCALES = (1, 2, 4)
"""Pixels that are averaged into one, in both directions, before patches are taken."""

DIRECTIONS = 32
"""Random directions, orthogonal to each other, on which patches are projected; always the same ones."""

QUANTILES = 512
"""Quantiles at which distributions on a direction are compared."""

PATCHES = 20_000
"""Patches of a picture and scale that count, about, evenly chosen: forty a quantile say enough, and large grids
have ten times as many."""

SMOKE_FRACTION = 0.05
"""Fraction of a picture's largest value: a patch without a brighter pixel shows no smoke."""

PART_FRACTION = 0.2
"""Fraction of a ray's largest density from which on its smoke is in a part of it."""

MODE_FRACTION = 0.1
"""Fraction of the smoke of a ray's parts from which on its second largest part counts as another mode."""

FAINT_RAY, FAINT_ROW = 0.1, 0.02
"""Fractions of the smoke of a usual ray (the ninth decile) and of the largest row, below which one does not count."""


def finite_array(values: npt.ArrayLike) -> Doubles:
    """Return an array of float64; ValueError if it holds anything but finite numbers."""
    if isinstance(values, StaggeredGrid):
        raise ValueError("a velocity must be an array of vectors at voxel centers: velocity.centres(), not a Velocity")
    array = numbers(values, "values", np.float64)
    if not np.isfinite(array).all():
        raise ValueError("values must be finite; replace those that are not, or leave their pixels or voxels out")
    return array


def relative(error: float, norm: float) -> float:
    """Return an error beside a norm: 0 where both are, infinity where only the norm is."""
    if norm == 0.0:
        return 0.0 if error == 0.0 else math.inf
    return error / norm


@dataclass(frozen=True, eq=False)
class PatchStatistics:
    """The distributions of a picture's patches, each without its mean, on random directions and on waves.

    Attributes
    ----------
    quantiles
        Of each of `SCALES` on the random directions, then on the waves, [scale, direction, quantile].
    spread
        Standard deviations, [scale, direction].
    """

    quantiles: Doubles
    spread: Doubles

    @staticmethod
    def of(picture: npt.ArrayLike) -> "PatchStatistics":
        """Return the statistics of a picture (rows, columns) of smoke before black."""
        values = finite_array(picture)
        if values.ndim != 2:
            raise ValueError(f"patches need a picture (rows, columns), not one of shape {values.shape}")
        projected = [_basis().T @ _patches(block_means(values, scale)).T for scale in SCALES]
        quantiles = np.stack([_quantiles(scale) for scale in projected])
        return PatchStatistics(quantiles, np.stack([scale.std(axis=1) for scale in projected]))

    def distance(self, reference: "PatchStatistics") -> float:
        """Return the sliced Wasserstein distance from a reference, in units of its spread; the mean over the scales.

        Elnekave and Weiss, "Generating natural images with direct patch distributions matching" (ECCV 2022). Every
        random direction holds something of every wave, so what is strongest decides: outlines and slow shading.

        Returns
        -------
        0 for equal distributions, about 1 if only the reference has smoke; infinity if only the reference has none.
        """
        away, spread = (np.sqrt(np.mean(values[:, :DIRECTIONS] ** 2, axis=1)) for values in self._beside(reference))
        return _mean_ratio(away, spread)

    def texture_distance(self, reference: "PatchStatistics") -> float:
        """Return the distance on the waves, each in units of its own spread; the mean over scales and waves.

        All sizes and directions of detail count alike, so it sees what is constant along rows, soft or noisy, however
        faint. Its range is that of `distance`.
        """
        away, spread = (values[:, DIRECTIONS:].ravel() for values in self._beside(reference))
        return _mean_ratio(away, spread)

    def _beside(self, reference: "PatchStatistics") -> tuple[Doubles, Doubles]:
        """Distances on every direction, and the reference's spread there, [scale, direction]."""
        return np.sqrt(np.mean((self.quantiles - reference.quantiles) ** 2, axis=2)), reference.spread


def mean_gradient(picture: npt.ArrayLike) -> float:
    """Return the sum of a picture's gradients over that of its values: how sharp it is; 0 for a black one.

    The picture (rows, columns) has two of both at least.
    """
    values = finite_array(picture)
    down, right = np.gradient(values)
    total = float(values.sum())
    return float(np.hypot(down, right).sum()) / total if total > 0 else 0.0


@lru_cache(maxsize=1)
def _basis() -> Doubles:
    """Random directions, then all waves but the constant one: each size and direction of detail has one of its own.

    They are made where they are used: on import, linear algebra would begin threads of its own.
    """
    random = np.linalg.qr(np.random.default_rng(1).standard_normal((PATCH**2, PATCH**2)))[0][:, :DIRECTIONS]
    cosines = fft.dct(np.eye(PATCH), norm="ortho", axis=0)
    waves = np.einsum("ax,by->xyab", cosines, cosines).reshape(PATCH**2, PATCH**2)
    return np.concatenate([random, waves[:, 1:]], axis=1)


def _mean_ratio(values: Doubles, references: Doubles) -> float:
    return float(np.mean([relative(*pair) for pair in zip(values.tolist(), references.tolist(), strict=True)]))


def _patches(picture: Doubles) -> Doubles:
    """The patches around pixels with smoke near them, each without its mean, [patch, pixel]; one of zeros if none."""
    around = sliding_window_view(np.pad(picture, PATCH // 2), (PATCH, PATCH))
    rows, columns = np.nonzero(around.max((2, 3)) > SMOKE_FRACTION * picture.max())
    step = max(1, len(rows) // PATCHES)
    chosen = around[rows[::step], columns[::step]].reshape(-1, PATCH**2)
    return chosen - chosen.mean(1, keepdims=True) if len(chosen) else np.zeros((1, PATCH**2))


def _quantiles(values: Doubles) -> Doubles:
    """Quantiles of each row (rows, columns), interpolated linearly, shape (rows, `QUANTILES`)."""
    ordered = np.sort(values.astype(np.float32), axis=1)
    place = (np.arange(QUANTILES) + 0.5) / QUANTILES * (values.shape[1] - 1)
    below = place.astype(int)
    fraction = place - below
    above = np.minimum(below + 1, values.shape[1] - 1)
    return np.asarray((1 - fraction) * ordered[:, below] + fraction * ordered[:, above])


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
