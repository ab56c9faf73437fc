"""Copied detail: how alike two pictures' fine detail is where one may be shifted and mirrored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import fft

from smokelift.evaluation.metrics.checks import Array, finite
from smokelift.evaluation.metrics.detail import fine_detail, smoke_pixels

OVERLAP = 0.5
"""Share of the smaller smoke's pixels that a shift leaves in common at least: a few pixels correlate by chance."""


@dataclass(frozen=True, eq=False)
class _Waves:
    """Fourier transforms of a picture's smoke mask, of its detail there, and of that detail's square."""

    mask: npt.NDArray[np.complex64]
    detail: npt.NDArray[np.complex64]
    square: npt.NDArray[np.complex64]
    pixels: int


def aligned_detail_correlation(a: npt.ArrayLike, b: npt.ArrayLike) -> float:
    """Return the largest correlation of two pictures' fine detail under any shift, with one mirrored or not.

    It shows copies that `detail_correlation` misses: a picture that was shifted or mirrored before it was put into
    another view. Detail is as in `row_constant_detail`, each picture's where that picture shows smoke. Correlations of
    all shifts come from fast Fourier transforms (D. Padfield, "Masked object registration in the Fourier domain",
    IEEE Transactions on Image Processing 21, 2012). Independent smoke has no zero either, because the best of many
    shifts counts: compare with the truth's.

    Parameters
    ----------
    a, b
        Shape (rows, columns), each its own: the smoke alone, as its difference from the background.

    Returns
    -------
    -1 to 1; 0 where a picture shows no detail.

    Raises
    ------
    ValueError
        If a value is not finite or a picture has not two axes.
    """
    first, second = finite(a), finite(b)
    if first.ndim != 2 or second.ndim != 2:
        raise ValueError(f"pictures must be (rows, columns), not of the shapes {first.shape} and {second.shape}")
    size = [fft.next_fast_len(m + n - 1, real=True) for m, n in zip(first.shape, second.shape, strict=True)]
    still = _waves(first, size)
    return max(_best_shift(still, _waves(picture, size), size) for picture in (second, second[:, ::-1]))


def _waves(values: Array, size: list[int]) -> _Waves:
    smoke = smoke_pixels(values)
    detail = np.where(smoke, fine_detail(values), 0.0)
    largest = float(np.abs(detail).max(initial=0.0))
    scaled = (detail / largest if largest > 0 else detail).astype(np.float32)
    mask, waves, square = (fft.rfft2(part, size) for part in (smoke.astype(np.float32), scaled, scaled**2))
    return _Waves(mask, waves, square, int(smoke.sum()))


def _best_shift(a: _Waves, b: _Waves, size: list[int]) -> float:
    def sums(one: npt.NDArray[np.complex64], other: npt.NDArray[np.complex64]) -> Array:
        """The sum of products over the common pixels, for every shift."""
        return np.asarray(fft.irfft2(np.conj(one) * other, size), np.float64)

    count = sums(a.mask, b.mask)
    enough = count > max(1.5, OVERLAP * min(a.pixels, b.pixels))
    if not enough.any():
        return 0.0
    count = count[enough]
    mean_a, mean_b = sums(a.detail, b.mask)[enough] / count, sums(a.mask, b.detail)[enough] / count
    spread_a = sums(a.square, b.mask)[enough] / count - mean_a**2
    spread_b = sums(a.mask, b.square)[enough] / count - mean_b**2
    common = sums(a.detail, b.detail)[enough] / count - mean_a * mean_b
    norm = np.sqrt(np.maximum(spread_a, 0.0) * np.maximum(spread_b, 0.0))
    clear = norm > 1e-3 * norm.max()  # below, rounding decides
    return float(np.clip(common[clear] / norm[clear], -1.0, 1.0).max()) if clear.any() else 0.0
