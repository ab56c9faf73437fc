"""Two densities and the motion between them, to compare an estimate with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.evaluation.truth import Truth
from smokelift.transport import Array

SMOKE = 0.01
"""Fraction of the largest density from which a voxel counts as smoke."""


@dataclass(frozen=True, eq=False)
class Pair:
    """What an estimate gets, and what it should find.

    Attributes
    ----------
    before, after : (nx, ny, nz) float32
        The densities.
    motion : (nx, ny, nz, 3) float32
        What carries the one into the other, in voxels a frame, at voxel centres and at the points of arrival.
    inlet : (nx, ny, nz) bool
        Where smoke enters; no estimate is told.
    """

    before: Array
    after: Array
    motion: Array
    inlet: npt.NDArray[np.bool_]

    @property
    def counted(self) -> npt.NDArray[np.bool_]:
        """The voxels that are compared: smoke and the two around it, without the inlet and the one around that."""
        around = ndimage.binary_dilation(self.after > SMOKE * self.after.max(), iterations=2)
        return np.asarray(around & ~ndimage.binary_dilation(self.inlet))


def frames_for_pairs(name: str, truth: Truth, count: int) -> list[int]:
    """The first frames of so many pairs, spread evenly over a known scene.

    Raises
    ------
    ValueError
        If there are too few frames, or no smoke or no motion in one of them.
    """
    last = truth.frames - 1
    if last <= count:
        raise ValueError(f"{name}: has {truth.frames} frames; {count} pairs of them need at least {count + 2}.")
    frames = [round(last * (k + 1) / (count + 1)) for k in range(count)]
    for frame in frames:
        smoke = truth.densities[frame : frame + 2].any(axis=(1, 2, 3)).all()
        if not (smoke and any(component[frame].any() for component in truth.faces)):
            raise ValueError(f"{name}: frame {frame} has no smoke that moves; give a scene with smoke all along.")
    return frames


def pair_of_truth(truth: Truth, frame: int) -> Pair:
    """A frame of a known scene and the next one."""
    return Pair(
        truth.density(frame),
        truth.density(frame + 1),
        truth.velocity(frame).centres() * np.float32(truth.dt / truth.voxel_size),
        truth.inflow(frame + 1),
    )


def relative_error(found: Array, wanted: Array, where: npt.NDArray[np.bool_]) -> float:
    """Relative L2 distance of two vector fields (nx, ny, nz, 3) in some of the voxels."""
    return float(np.linalg.norm((found - wanted)[where]) / np.linalg.norm(wanted[where]))
