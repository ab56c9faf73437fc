"""Noise in densities: how much there is, and how much blur takes it off.

White noise is as strong in the finest scale, where neighbours alternate along all axes at once, as in any other; smoke
has next to nothing there. So the median of that scale's magnitude inside the smoke measures the noise and not the smoke
(Donoho and Johnstone 1994), and blur is chosen by it: gradients have to stand out from what noise makes of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift import _core
from smokelift.transport import Array
from smokelift.velocity.contrast import compressed

NOISE_WIDTHS = (1.0, 1.5, 2.0)
"""Standard deviations in voxels to choose from where the usual blur leaves too much."""

LARGEST_SHARE = 0.35
"""Noise that is left in the change between two densities, in root mean square gradients (that is, in voxels of motion):
a third moves an estimate by less than smoke's own finest scales do."""

SMOOTHNESS = 0.045
"""The same where densities are smooth already and neither blur nor compression helps: from one view reconstructed ones
(0.015 to 0.025; their thin smoke is the least certain) and blurred ones (0.02 to 0.04). Baked ones have 0.055 to 0.19.
"""

MAD = 0.6745
"""Median magnitude of a normal variable in standard deviations."""


@dataclass(frozen=True, eq=False)
class Followed:
    """Two densities as their motion is looked for.

    Attributes
    ----------
    before, after : (nx, ny, nz) float32
        Blurred, and perhaps compressed.
    noise
        Variance of the noise that is left in their difference.
    compressed
        Whether they are.
    """

    before: Array
    after: Array
    noise: float
    compressed: bool


def followed(before: Array, after: Array, blur: float, threshold: float, threads: int) -> Followed:
    """Blur and compress two densities; leave them as they are where smooth, and only blur where noisy.

    Parameters
    ----------
    before, after : (nx, ny, nz) float32
        The densities.
    blur
        Standard deviation in voxels of the Gaussian that smooths in any case.
    threshold
        Fraction of the largest density from which a voxel counts as smoke.
    threads
        Processor cores.
    """
    smooth, enough = without_noise(before, after, ((0.0, SMOOTHNESS),), threshold, threads)
    if enough:
        return Followed(*smooth, compressed=False)
    sharp, enough = without_noise(compressed(before), compressed(after), ((blur, LARGEST_SHARE),), threshold, threads)
    if enough:
        return Followed(*sharp, compressed=True)
    widths = (blur, *(width for width in NOISE_WIDTHS if width > blur))
    limits = tuple((width, LARGEST_SHARE) for width in widths)
    noisy, _ = without_noise(before, after, limits, threshold, threads)
    return Followed(*noisy, compressed=False)


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
    before: Array, after: Array, widths: tuple[tuple[float, float], ...], threshold: float, threads: int
) -> tuple[tuple[Array, Array, float], bool]:
    """Blur two densities as much as their noise asks for.

    Parameters
    ----------
    before, after : (nx, ny, nz) float32
        The densities.
    widths
        Standard deviations in voxels to choose from, rising, 0 for none, and how much noise each may leave, in root
        mean square gradients. The last is taken where none is enough.
    threshold
        Fraction of the largest density from which a voxel counts as smoke.
    threads
        Processor cores.

    Returns
    -------
    before, after, variance
        Blurred, and the variance of the noise that is left in their difference.
    enough
        Whether that is within what the last width may leave.
    """
    smoke = after > threshold * after.max()
    raw = float(np.hypot(noise_level(before, smoke), noise_level(after, smoke)))
    for width, share in widths:
        first, second = (_core.blur(a, width, 4.0, threads) if width > 0 else a for a in (before, after))
        left = raw * _passed(width)
        enough = left <= share * _gradient(second, smoke)
        if enough:
            break
    return (first, second, left**2), enough


def _gradient(density: Array, smoke: npt.NDArray[np.bool_]) -> float:
    """Root mean square of the gradient in the smoke."""
    if not smoke.any():
        return 0.0
    return float(np.sqrt(sum(np.mean(np.square(g[smoke])) for g in _core.gradient(density))))


def _passed(width: float) -> float:
    """Share of the standard deviation of white noise that a Gaussian lets through."""
    if width <= 0:
        return 1.0
    spike = np.zeros(int(8 * width) * 2 + 3)
    spike[len(spike) // 2] = 1
    kernel = ndimage.gaussian_filter1d(spike, width)
    return float(np.sum(kernel**2) ** 1.5)
