"""How alike two pictures are."""

import math

import numpy.typing as npt
from scipy import ndimage

from smokelift.checks import Doubles
from smokelift.evaluation.metrics.volumes import checked_mask, pair
from smokelift.transport import require_positive


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
    mean = float(error[checked_mask(mask, error.shape)].mean())
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

    def smooth(picture: Doubles) -> Doubles:
        sigma = (1.5, 1.5, 0.0)[: picture.ndim]
        blurred: Doubles = ndimage.gaussian_filter(picture, sigma, truncate=5 / 1.5)
        return blurred[5:-5, 5:-5]

    mean_a, mean_b = smooth(first), smooth(second)
    variance_a = smooth(first * first) - mean_a**2
    variance_b = smooth(second * second) - mean_b**2
    covariance = smooth(first * second) - mean_a * mean_b
    c1, c2 = (0.01 * peak) ** 2, (0.03 * peak) ** 2
    above = (2 * mean_a * mean_b + c1) * (2 * covariance + c2)
    below = (mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)
    return float((above / below).mean())
