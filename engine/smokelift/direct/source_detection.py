"""Smoke that enters: found from what no motion explains.

Where a velocity is wrong, the change that it leaves unexplained has both signs side by side, because smoke is moved and
not made. Where smoke enters, the change is positive all over. So a source shows in the mean of the residual over a few
voxels, beside the mean of its magnitude: their ratio, the coherence, is near one in an inlet and near zero elsewhere.

A source also stands out from what is left unexplained in the rest of the smoke, and from other sources. The front of
smoke that is faster than the velocity looks like a wide, weak source.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import smokelift._core as _core
from smokelift.checks.array_types import Array, Mask

MIN_DENSITY_SHARE = np.float32(1e-4)
"""Share of the largest density below which a residual means nothing."""


class ResidualMeans(NamedTuple):
    """Means over a few voxels, and over past frames, of the change that velocities leave unexplained.

    Attributes
    ----------
    mean, magnitude : (nx, ny, nz) float32
        Of the residual and of its magnitude, as shares of the largest density.
    """

    mean: Array
    magnitude: Array


@dataclass(frozen=True)
class SourceDetection:
    """How smoke that enters is distinguished from motion. docs/experiments/velocity-weights.md has the sweeps.

    Attributes
    ----------
    width
        Standard deviation, in voxels, of the Gaussian that takes the means. Wider ones miss small
        inlets.
    coherence
        Mean residual over mean magnitude: nothing is a source below the first, everything that stands out is one
        above the second.
    strength
        The same for the mean residual, in medians of its magnitude over the smoke.
    prominence
        The same for the mean residual as a share of the strongest source's: inlets of one scene are of one kind.
    news
        Weight of the frame at hand in an exponential moving average. Inlets stand still; what a wrong velocity leaves
        moves on.
    """

    width: float = 2.0
    coherence: tuple[float, float] = (0.4, 0.6)
    strength: tuple[float, float] = (3.0, 6.0)
    prominence: tuple[float, float] = (0.1, 0.2)
    news: float = 0.2

    def means(self, residual: Array, density: Array, past: ResidualMeans | None) -> ResidualMeans:
        """Means over a few voxels, and over the frames before, of what the velocity so far leaves unexplained.

        ``residual`` (nx, ny, nz) is the density after less the one carried along, ``density`` the larger of the two.
        ``past`` are the means up to the frame before.
        """
        relative = residual / max(density.max(), np.float32(1e-30))
        mean = _core.blur(relative, self.width, 3.0)
        magnitude = _core.blur(np.abs(relative), self.width, 3.0)
        if past is not None:
            for now, before in ((mean, past.mean), (magnitude, past.magnitude)):
                now *= np.float32(self.news)
                now += np.float32(1 - self.news) * before
        return ResidualMeans(mean, magnitude)

    def weight(self, found: ResidualMeans, smoke: Mask) -> Array:
        """How far each voxel's change may be taken for motion (nx, ny, nz): 0 where smoke enters, 1 where nothing does.

        ``found`` is what the velocity so far leaves unexplained.
        """
        mean = found.mean
        typical = float(np.median(np.abs(mean[smoke]))) if smoke.any() else 0.0
        if typical == 0.0:
            return np.ones(mean.shape, np.float32)
        coherent = _ramp(mean / (found.magnitude + MIN_DENSITY_SHARE), self.coherence)
        strong = _ramp(mean / np.float32(typical), self.strength)
        prominent = _ramp(mean / max(np.max(coherent * mean), MIN_DENSITY_SHARE), self.prominence)
        weight: Array = 1 - coherent * strong * prominent
        return weight


def _ramp(values: Array, ends: tuple[float, float]) -> Array:
    low, high = ends
    ramp: Array = (values - np.float32(low)) / np.float32(high - low)
    np.maximum(ramp, 0, out=ramp)  # together a fraction of what np.clip takes
    np.minimum(ramp, 1, out=ramp)
    return ramp
