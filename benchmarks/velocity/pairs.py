"""Two densities and the motion between them, to compare an estimate with."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from smokelift.checks import Mask
from smokelift.evaluation.truth import Truth
from smokelift.transport import Array

SMOKE = 0.01
"""Fraction of the largest density from which a voxel counts as smoke."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two densities, and the motion that an estimate should find between them.

    Attributes
    ----------
    before, after : (nx, ny, nz) float32
        Densities of two frames.
    motion : (nx, ny, nz, 3) float32
        What carries the first into the second, in voxels per frame, at voxel centers and at the points of arrival.
    inlet : (nx, ny, nz) bool
        Where smoke enters. Estimates do not know it.
    """

    before: Array
    after: Array
    motion: Array
    inlet: Mask

    @property
    def compared(self) -> Mask:
        """The voxels that are compared: near smoke and away from the inlet."""
        return near_smoke(self.after) & away_from(self.inlet)


def near_smoke(density: Array) -> Mask:
    """Return the voxels with smoke and the two around them, where a velocity still matters."""
    return np.asarray(ndimage.binary_dilation(density > SMOKE * density.max(), iterations=2))


def away_from(inlet: Mask) -> Mask:
    """Return the voxels that neither are in an inlet nor touch one: smoke enters there without being carried."""
    return np.asarray(~ndimage.binary_dilation(inlet))


def pair_of_truth(truth: Truth, frame: int) -> Pair:
    """Return a frame of a known scene and the next one."""
    return Pair(
        truth.density(frame),
        truth.density(frame + 1),
        truth.velocity(frame).centres() * np.float32(truth.dt / truth.voxel_size),
        truth.inflow(frame + 1),
    )
