"""Noise in densities: how much there is, and how much blur takes it off.

White noise is as strong in the finest scale, where neighbours alternate along all axes at once, as in any other; smoke
has next to nothing there. So the median of that scale's magnitude inside the smoke measures the noise and not the smoke
(Donoho and Johnstone 1994), and blur is chosen by it: gradients have to stand out from what noise makes of them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift import _core
from smokelift.transport import Array

NOISE_WIDTHS = (1.0, 1.5, 2.0)
"""Standard deviations in voxels to choose from where the usual blur leaves too much."""

LARGEST_SHARE = 0.35
"""Noise that is left in the change between two densities, in root mean square gradients (that is, in voxels of motion):
a third moves an estimate by less than smoke's own finest scales do."""

MAD = 0.6745
"""Median magnitude of a normal variable in standard deviations."""


def noise_level(density: Array, smoke: npt.NDArray[np.bool_]) -> float:
    """Standard deviation of white noise in a density, from its finest scale inside the smoke."""
    finest, inside = density, smoke
    for axis in range(3):
        low, high = (
            tuple(part if d == axis else slice(None) for d in range(3)) for part in (slice(1, None), slice(-1))
        )
        finest = (finest[low] - finest[high]) / np.float32(np.sqrt(2.0))
        inside = inside[low] & inside[high]
    if not inside.any():
        return 0.0
    return float(np.median(np.abs(finest[inside]))) / MAD


def without_noise(
    before: Array, after: Array, widths: tuple[float, ...], threshold: float
) -> tuple[Array, Array, float]:
    """Blur two densities as much as their noise asks for.

    Parameters
    ----------
    before, after : (nx, ny, nz) float32
        The densities.
    widths
        Standard deviations in voxels to choose from, rising; 0 for none. The last is taken where none is enough.
    threshold
        Fraction of the largest density from which a voxel counts as smoke.

    Returns
    -------
    before, after
        Blurred.
    variance
        Of the noise that is left in their difference.
    """
    smoke = after > threshold * after.max()
    raw = float(np.hypot(noise_level(before, smoke), noise_level(after, smoke)))
    for width in widths:
        first, second = (ndimage.gaussian_filter(a, width) if width > 0 else a for a in (before, after))
        left = raw * _passed(width)
        gradient = np.sqrt(sum(np.mean(np.square(g[smoke])) for g in _core.gradient(second))) if smoke.any() else 0.0
        if left <= LARGEST_SHARE * gradient:
            break
    return first, second, left**2


def _passed(width: float) -> float:
    """Share of the standard deviation of white noise that a Gaussian lets through."""
    if width <= 0:
        return 1.0
    spike = np.zeros(int(8 * width) * 2 + 3)
    spike[len(spike) // 2] = 1
    kernel = ndimage.gaussian_filter1d(spike, width)
    return float(np.sum(kernel**2) ** 1.5)
