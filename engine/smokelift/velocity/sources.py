"""Smoke that enters: found from what no motion explains.

Where a velocity is wrong, the change that it leaves unexplained has both signs side by side, since smoke is moved and
not made; where smoke enters, it is positive all over. So a source shows in the mean of the residual over a few voxels,
beside the mean of its magnitude: their ratio, the coherence, is near one in an inlet and near zero elsewhere. A source
also has to stand out from what is left unexplained in the rest of the smoke, and from other sources: the front of
smoke that is faster than the estimate looks like a wide, weak one, and once the change there counts no more, the
estimate gets slower still.

An inlet is worth more than any refinement of the solver: read as motion, new smoke turns the flow at the base around.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from smokelift import _core
from smokelift.transport import Array

WIDTH = 2.0
"""Standard deviation, in voxels of the finest grid, of the Gaussian that takes the means. With 4, small inlets of fast
jets were missed."""

COHERENCE = (0.4, 0.6)
"""Nothing is a source below the first, everything that stands out is one above the second."""

STRENGTH = (3.0, 6.0)
"""The same for the mean residual, in medians of its magnitude over the smoke."""

PROMINENCE = (0.1, 0.2)
"""The same for the mean residual, beside that of the strongest source: inlets of one scene are of one kind. A fast
jet's error falls from 0.42 to 0.29 by it, as the true inlet is lost among false ones no more."""

NEWS = 0.2
"""How much the frame at hand counts in a mean over frames. Inlets stand still, and what a wrong velocity leaves moves
on: the true inlet of a fast jet, lost after some frames without a memory (error 0.51), is kept (0.35). 0.15 and 0.3 are
as good but for that jet (0.39, 0.36)."""

FAINT = np.float32(1e-4)
"""Fraction of the largest density below which a residual means nothing."""


@dataclass(frozen=True, eq=False)
class Unexplained:
    """What a velocity leaves of the change around every voxel.

    Attributes
    ----------
    mean, magnitude : (nx, ny, nz) float32
        Of the residual and of its magnitude, in shares of the largest density.
    """

    mean: Array
    magnitude: Array


def left_unexplained(
    residual: Array, density: Array, coarseness: float, past: Unexplained | None, threads: int
) -> Unexplained:
    """Means of a residual over a few voxels, and over the frames before.

    Parameters
    ----------
    residual : (nx, ny, nz) float32
        What the velocity so far leaves unexplained: density after less density carried along.
    density : (nx, ny, nz) float32
        The larger of the two.
    coarseness
        Voxels of the finest grid along a voxel.
    past
        Means up to the frame before.
    threads
        Processor cores.
    """
    width, relative = WIDTH / coarseness, residual / max(density.max(), np.float32(1e-30))
    mean = _core.blur(relative, width, 3.0, threads)
    magnitude = _core.blur(np.abs(relative), width, 3.0, threads)
    if past is not None:
        for now, before in ((mean, past.mean), (magnitude, past.magnitude)):
            now *= np.float32(NEWS)
            now += np.float32(1 - NEWS) * before
    return Unexplained(mean, magnitude)


def source_weight(found: Unexplained, smoke: npt.NDArray[np.bool_]) -> Array:
    """How far the change of each voxel may be taken for motion.

    Parameters
    ----------
    found
        What the velocity so far leaves unexplained.
    smoke : (nx, ny, nz) bool
        Where there is smoke.

    Returns
    -------
    (nx, ny, nz) float32
        0 where smoke enters, 1 where nothing does.
    """
    mean = found.mean
    typical = float(np.median(np.abs(mean[smoke]))) if smoke.any() else 0.0
    if typical == 0.0:
        return np.ones(mean.shape, np.float32)
    coherent = _ramp(mean / (found.magnitude + FAINT), COHERENCE)
    strong = _ramp(mean / np.float32(typical), STRENGTH)
    prominent = _ramp(mean / max(np.max(coherent * mean), FAINT), PROMINENCE)
    weight: Array = 1 - coherent * strong * prominent
    return weight


def _ramp(values: Array, ends: tuple[float, float]) -> Array:
    low, high = ends
    ramp: Array = (values - np.float32(low)) / np.float32(high - low)
    np.maximum(ramp, 0, out=ramp)  # together a fraction of what np.clip takes
    np.minimum(ramp, 1, out=ramp)
    return ramp
