"""Smoke that enters: found from what no motion explains.

Where a velocity is wrong, the change that it leaves unexplained has both signs side by side, because smoke is moved and
not made. Where smoke enters, the change is positive all over. So a source shows in the mean of the residual over a few
voxels, beside the mean of its magnitude: their ratio, the coherence, is near one in an inlet and near zero elsewhere.

A source also stands out from what is left unexplained in the rest of the smoke, and from other sources. The front of
smoke that is faster than the estimate looks like a wide, weak source; taken for one, it would slow the estimate more.
An inlet that is read as motion turns the flow at the base around.

Before anything is known of the velocity, an inlet cannot be seen: its smoke is renewed as it leaves, so it stands still
like smoke at rest. Taken for rest it holds the flow, and a flow that is held leaves nothing unexplained that would show
the inlet. So the first estimate believes smoke by how far it is seen to move, and takes what stands still from around.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import smokelift._core as _core
from smokelift.transport import Array, Faces, ResidualMeans

MIN_DENSITY_SHARE = np.float32(1e-4)
"""Share of the largest density below which a residual means nothing."""

RESTING = np.float32(0.05)
"""Speed (voxels a frame) below which smoke rests."""


@dataclass(frozen=True)
class SourceDetection:
    """How smoke that enters is distinguished from motion. docs/experiments/velocity-sources.md has the sweeps.

    Attributes
    ----------
    width
        Standard deviation, in voxels of the finest grid, of the Gaussian that takes the means. Wider ones miss small
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
    still
        Speed that smoke is seen to move at, in medians over the smoke, at which a first estimate believes it by half.
    """

    width: float = 2.0
    coherence: tuple[float, float] = (0.4, 0.6)
    strength: tuple[float, float] = (3.0, 6.0)
    prominence: tuple[float, float] = (0.1, 0.2)
    news: float = 0.2
    still: float = 8.0

    def means(self, residual: Array, density: Array, coarseness: float, past: ResidualMeans | None) -> ResidualMeans:
        """Means over a few voxels, and over the frames before, of what the velocity so far leaves unexplained.

        ``residual`` (nx, ny, nz) is the density after less the one carried along, ``density`` the larger of the two,
        and ``coarseness`` the number of voxels of the finest grid along a voxel. ``past`` are the means up to the frame
        before.
        """
        width, relative = self.width / coarseness, residual / max(density.max(), np.float32(1e-30))
        mean = _core.blur(relative, width, 3.0)
        magnitude = _core.blur(np.abs(relative), width, 3.0)
        if past is not None:
            for now, before in ((mean, past.mean), (magnitude, past.magnitude)):
                now *= np.float32(self.news)
                now += np.float32(1 - self.news) * before
        return ResidualMeans(mean, magnitude)

    def first_weight(self, direction: Faces, change: Array, smoke: npt.NDArray[np.bool_]) -> Array:
        """How far each voxel's change may be taken for motion before anything is known of the velocity.

        The weight (nx, ny, nz) is 0 where smoke stands still, 1 where it is seen to move fast. ``direction`` is the
        gradient of the density at voxel centres, one array (nx, ny, nz) a component; ``change`` is from one frame to
        the next.
        """
        squares = np.square(change), np.sum([np.square(g) for g in direction], axis=0)
        moved, steepness = (_core.blur(values, 1.0, 3.0) for values in squares)
        speed = moved / (steepness + MIN_DENSITY_SHARE * max(steepness.max(), np.float32(1e-20)))
        # where most smoke is at rest, what stands still is believed
        usual = float(np.median(speed[smoke])) if smoke.any() else 0.0
        weight: Array = (speed + RESTING**2) / (speed + RESTING**2 + np.float32(self.still**2 * usual))
        return weight

    def weight(self, found: ResidualMeans, smoke: npt.NDArray[np.bool_]) -> Array:
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
