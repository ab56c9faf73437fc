"""Densities made ready before their motion is estimated: noise is blurred, contrast reduced.

Noise: white noise is as strong in the finest scale, where neighbors alternate along all axes at once, as in any other.
Smoke has next to nothing there. So the median of that scale's magnitude inside the smoke measures the noise and not the
smoke (Donoho and Johnstone 1994). It chooses the blur: gradients have to stand out from what noise makes of them.

Contrast: any function of a density is carried along just like the density, so the one to follow is free to choose. With
the density itself the thick smoke at the base of a plume decides everything. With its power of 3/4 thin smoke counts as
well (docs/experiments/velocity-solver.md). Noise would count as well, so noisy densities are followed as they are. So
are smooth ones.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

import smokelift._core as _core
from smokelift.transport import Array
from smokelift.velocity.linearization import SMOKE_THRESHOLD, gradient, rms_gradient

BLUR = 0.5
"""Standard deviation (voxels) of the Gaussian that smooths densities which are neither smooth nor noisy."""

NOISE = 0.35
"""Allowed noise in the difference of two densities, divided by the root mean square gradient: voxels of motion
(docs/experiments/velocity-solver.md)."""

SMOOTH = 0.045
"""Noise in the same unit below which densities are smooth already, and neither blurred nor compressed
(docs/experiments/velocity-solver.md)."""

MAD = 0.6745
"""Median magnitude of a normal variable, in standard deviations (by definition)."""


@dataclass(frozen=True, eq=False)
class PreparedPair:
    """Two densities (nx, ny, nz) as their motion is estimated from: blurred, and perhaps with less contrast.

    `noise` is the variance of the noise that is left in their difference. If `reduced`, they are the power of 3/4 of
    the densities.
    """

    before: Array
    after: Array
    noise: float
    reduced: bool

    def density_dissipation(self, fraction: float) -> float:
        """The fraction of the density that dissolves where a fraction of the values does."""
        return float(1 - (1 - fraction) ** (4 / 3)) if self.reduced else fraction


ATTEMPTS = (
    (False, 0.0, SMOOTH),
    (True, BLUR, NOISE),
    (False, BLUR, NOISE),
    (False, 1.0, NOISE),
    (False, 1.5, NOISE),
    (False, 2.0, NOISE),
)
"""Whether contrast is reduced, the standard deviation of the blur (voxels), and the noise that may be left: the first
that leaves no more is taken, else the last. Smooth densities stay as they are, and noisy ones are only blurred."""


def prepare(before: Array, after: Array) -> PreparedPair:
    """Blur two densities and reduce their contrast, as the first of `ATTEMPTS` that leaves little noise."""
    for reduced, width, allowed in ATTEMPTS:
        first, second = (reduced_contrast(a) if reduced else a for a in (before, after))
        smoke = second > SMOKE_THRESHOLD * second.max()
        raw = float(np.hypot(noise_level(first, smoke), noise_level(second, smoke)))
        first, second, left = blurred(first, width), blurred(second, width), raw * _passed(width)
        if left <= allowed * rms_gradient(gradient(second), smoke):
            break
    return PreparedPair(first, second, left**2, reduced)


def reduced_contrast(density: Array) -> Array:
    """density^(3/4)."""
    root = np.sqrt(density)
    result: Array = root * np.sqrt(root)
    return result


def noise_level(density: Array, smoke: npt.NDArray[np.bool_]) -> float:
    """Standard deviation of white noise in a density, from its finest scale inside the smoke."""
    finest, inside = density, smoke
    for axis in range(3):
        finest = np.diff(finest, axis=axis) / np.float32(np.sqrt(2.0))
        inside = np.delete(inside, 0, axis) & np.delete(inside, -1, axis)
    if not inside.any():
        return 0.0
    return float(np.median(np.abs(finest[inside]))) / MAD


def blurred(density: Array, width: float) -> Array:
    """A density blurred by a standard deviation in voxels, 0 for none."""
    return _core.blur(density, width, 4.0) if width > 0 else density


def _passed(width: float) -> float:
    """Fraction of white noise's standard deviation that a Gaussian lets through."""
    if width <= 0:
        return 1.0
    spike = np.zeros(int(8 * width) * 2 + 3)
    spike[len(spike) // 2] = 1
    kernel = ndimage.gaussian_filter1d(spike, width)
    return float(np.sum(kernel**2) ** 1.5)
