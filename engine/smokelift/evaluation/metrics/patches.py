"""Whether pictures of smoke have the same texture, wherever its parts are: distributions of small patches."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from smokelift.checks import Doubles
from smokelift.evaluation.metrics.errors import finite_array, relative
from smokelift.transport import block_means

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
