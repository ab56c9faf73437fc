"""How near a result is to the truth: pictures, densities, velocities.

Every function refuses arrays of different shapes and values that are not finite with ValueError: a NaN that
slips into a mean is worse than no figure.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


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
        If the shapes differ, a value is not finite, or no pixel counts.
    """
    first, second = _pair(a, b)
    error = (first - second) ** 2
    mean = float(error[_mask(mask, error.shape)].mean())
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
        If the shapes differ, the pictures are too small, or a value is not finite.
    """
    first, second = _pair(a, b)
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


def volume_error(density: npt.ArrayLike, truth: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> float:
    """Return the relative L2 error of a density, |density - truth| / |truth|.

    Parameters
    ----------
    density, truth
        Arrays of one shape.
    mask
        Which voxels count; None counts all.

    Returns
    -------
    0 for equal arrays; infinity if only the truth is zero everywhere.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or no voxel counts.
    """
    found, true = _pair(density, truth)
    counts = _mask(mask, found.shape)
    return _ratio(float(np.linalg.norm((found - true)[counts])), float(np.linalg.norm(true[counts])))


def mass(density: npt.ArrayLike, voxel_size: float) -> float:
    """Return the volume integral of a density, in density times cubic metres.

    Raises
    ------
    ValueError
        If a value is not finite.
    """
    return float(_finite(density).sum()) * voxel_size**3


def velocity_error(
    velocity: npt.ArrayLike, truth: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> tuple[float, float]:
    """Return how far a velocity is from the truth.

    Parameters
    ----------
    velocity, truth
        Vectors at voxel centres, shape (nx, ny, nz, 3), in one unit.
    mask
        Which voxels count (those with smoke, as a rule), shape (nx, ny, nz); None counts all.

    Returns
    -------
    The relative L2 error, and the mean cosine of the angle between both, over voxels where the truth moves
    faster than a millionth of its largest speed; a velocity of zero there has the cosine 0. Without any such
    voxel the cosine is 1.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or no voxel counts.
    """
    found, true = _pair(velocity, truth)
    counts = np.ones(found.shape[:-1], bool) if mask is None else np.asarray(mask, bool)
    if counts.shape != found.shape[:-1] or not counts.any():
        raise ValueError(f"the mask {counts.shape} must fit {found.shape[:-1]} voxels and count at least one")
    u, v = found[counts], true[counts]
    error = _ratio(float(np.linalg.norm(u - v)), float(np.linalg.norm(v)))
    speed = np.linalg.norm(v, axis=-1)
    moving = speed > 1e-6 * speed.max()
    if not moving.any():
        return error, 1.0
    lengths = np.linalg.norm(u, axis=-1)[moving] * speed[moving]
    products = (u * v).sum(axis=-1)[moving]
    cosine = np.divide(products, lengths, out=np.zeros_like(products), where=lengths > 0.0)
    return error, float(cosine.mean())


def _ratio(error: float, norm: float) -> float:
    if norm == 0.0:
        return 0.0 if error == 0.0 else math.inf
    return error / norm


def _finite(values: npt.ArrayLike) -> Array:
    array = np.asarray(values, np.float64)
    if not np.isfinite(array).all():
        raise ValueError("values must be finite")
    return array


def _pair(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[Array, Array]:
    first, second = _finite(a), _finite(b)
    if first.shape != second.shape:
        raise ValueError(f"shapes must be equal, not {first.shape} and {second.shape}")
    if first.size == 0:
        raise ValueError("arrays must not be empty")
    return first, second


def _mask(mask: npt.ArrayLike | None, shape: tuple[int, ...]) -> Any:
    if mask is None:
        return np.ones(shape, bool)
    counts = np.asarray(mask, bool)
    if counts.shape != shape[: counts.ndim] or not counts.any():
        raise ValueError(f"the mask {counts.shape} must fit {shape} and count at least one value")
    return counts
