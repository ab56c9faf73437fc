"""How alike two pictures are."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy import fft, ndimage

from smokelift.evaluation.metrics.checks import Array, counted, pair
from smokelift.scene.checks import number
from smokelift.transport import require_positive

Integers = npt.NDArray[np.int64]


def psnr(a: npt.ArrayLike, b: npt.ArrayLike, mask: npt.ArrayLike | None = None, peak: float = 1.0) -> float:
    """Return the peak signal-to-noise ratio of two pictures in dB.

    Parameters
    ----------
    a, b
        Pictures of one shape, in the encoding that is to be judged (usually sRGB values).
    mask
        Which pixels count, shape (rows, columns) or that of the pictures; None counts all.
    peak
        The value of white.

    Returns
    -------
    Decibels; infinity for equal pictures.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, no pixel counts, or the peak is not positive.
    """
    require_positive("peak", peak)
    first, second = pair(a, b)
    error = (first - second) ** 2
    mean = float(error[counted(mask, error.shape)].mean())
    return math.inf if mean == 0.0 else 10.0 * math.log10(peak**2 / mean)


def ssim(a: npt.ArrayLike, b: npt.ArrayLike, peak: float = 1.0) -> float:
    """Return the structural similarity of two pictures (Wang 2004), the mean over pixels and channels.

    The window is the usual Gaussian of 11 x 11 pixels and sigma 1.5; pixels nearer than 5 to an edge do not
    count.

    Parameters
    ----------
    a, b
        Pictures of one shape, (rows, columns) or (rows, columns, channels), at least 11 x 11.
    peak
        The value of white.

    Raises
    ------
    ValueError
        If the shapes differ, the pictures are too small, a value is not finite, or the peak is not positive.
    """
    require_positive("peak", peak)
    first, second = pair(a, b)
    if first.ndim not in (2, 3) or min(first.shape[:2]) < 11:
        raise ValueError(f"ssim needs pictures of at least 11 x 11 pixels, not of shape {first.shape}")

    def smooth(picture: Array) -> Array:
        sigma = (1.5, 1.5, 0.0)[: picture.ndim]
        blurred: Array = ndimage.gaussian_filter(picture, sigma, truncate=5 / 1.5)
        return blurred[5:-5, 5:-5]

    mean_a, mean_b = smooth(first), smooth(second)
    variance_a = smooth(first * first) - mean_a**2
    variance_b = smooth(second * second) - mean_b**2
    covariance = smooth(first * second) - mean_a * mean_b
    c1, c2 = (0.01 * peak) ** 2, (0.03 * peak) ** 2
    above = (2 * mean_a * mean_b + c1) * (2 * covariance + c2)
    below = (mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)
    return float((above / below).mean())


def shifted_psnr(
    a: npt.ArrayLike, b: npt.ArrayLike, reach: float = 0.25, peak: float = 1.0
) -> tuple[float, tuple[int, int]]:
    """Return the PSNR of two pictures after the best shift of the first by whole pixels.

    What is moved in from outside is zero: give differences from the background. The sum of squares of every shift
    comes from one correlation by fast Fourier transforms.

    Parameters
    ----------
    a, b
        Pictures of one shape, (rows, columns) or (rows, columns, channels).
    reach
        Largest shift, as a share of the rows and of the columns, 0 to 1.
    peak
        The value of white.

    Returns
    -------
    Decibels (infinity for equal pictures), and the shift in rows and columns.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, the reach is out of range, or the peak is not positive.
    """
    number(reach, "reach", "a number from 0 to 1", lambda share: 0 <= share <= 1)
    first, second = (np.atleast_3d(picture) for picture in pair(a, b))
    rows, columns = first.shape[:2]
    far = int(reach * rows), int(reach * columns)
    size = [fft.next_fast_len(n + f, real=True) for n, f in zip((rows, columns), far, strict=True)]
    waves = np.conj(fft.rfft2(first, size, axes=(0, 1))) * fft.rfft2(second, size, axes=(0, 1))
    overlap = fft.irfft2(waves.sum(axis=-1), size)
    down, right = (np.arange(-f, f + 1) for f in far)
    kept = _sums_inside((first**2).sum(axis=-1), down, right)
    squares = kept + float((second**2).sum()) - 2 * overlap[np.ix_(down, right)]
    row, column = np.unravel_index(int(squares.argmin()), squares.shape)
    shift = int(down[row]), int(right[column])
    return psnr(_shifted(first, shift), second, peak=peak), shift


def _sums_inside(values: Array, down: Integers, right: Integers) -> Array:
    """Sums of what stays of a picture (rows, columns) after each shift down (m,) and to the right (n,), shape (m, n).

    From a table of the sums over all rectangles in the first corner (Crow, "Summed-area tables for texture mapping",
    SIGGRAPH 1984).
    """
    rows, columns = values.shape
    table = np.zeros((rows + 1, columns + 1))
    table[1:, 1:] = values.cumsum(0).cumsum(1)
    top, bottom = np.maximum(0, -down), rows - np.maximum(0, down)
    left, end = np.maximum(0, -right), columns - np.maximum(0, right)
    sums: Array = table[np.ix_(bottom, end)] - table[np.ix_(top, end)] - table[np.ix_(bottom, left)]
    sums += table[np.ix_(top, left)]
    return sums


def _shifted(picture: Array, shift: tuple[int, int]) -> Array:
    """A picture (rows, columns, channels) moved down and to the right, zero where nothing comes from."""
    (down, right), (rows, columns) = shift, picture.shape[:2]
    moved = np.zeros_like(picture)
    there = np.s_[max(0, down) : rows + min(0, down), max(0, right) : columns + min(0, right)]
    here = np.s_[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)]
    moved[there] = picture[here]
    return moved
