"""Known smoke and reconstructions of it, as moments."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from smokelift.direct import SmokeState, complete_velocity
from smokelift.evaluation import metrics
from smokelift.evaluation.truth import Truth, resampled
from smokelift.transport import Array, Velocity, on_faces


def true_moment(truth: Truth, frame: int) -> SmokeState:
    """Return a moment of the truth, from frame 1."""
    velocity = replace(truth.velocity(frame - 1), closed=truth.closed)
    return SmokeState(truth.density(frame), complete_velocity(velocity))


def reconstructed_moment(folder: Path, truth: Truth, frame: int) -> SmokeState:
    """Return a moment of a run of `benchmarks.accuracy`, from frame 1."""
    with np.load(folder / f"{frame + 1:04d}.npz") as file:
        density, centers = (file[name].astype(np.float32) for name in ("density", "velocity"))
    voxel_size = truth.voxel_size * truth.shape[0] / density.shape[0]
    return SmokeState(density, complete_velocity(Velocity(on_faces(centers), voxel_size, truth.closed)))


def density_error(found: Array, true: Array) -> float:
    """Return the relative error of a density, on the true one's grid."""
    nx, ny, nz = true.shape
    return metrics.volume_error(resampled(found, (nx, ny, nz)), true)
