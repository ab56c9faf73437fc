"""Known smoke and reconstructions of it, as moments."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.accuracy.scenes import KnownScene
from benchmarks.accuracy.score import BLACK, KnownDensities, known_densities
from smokelift.direct import SmokeState, complete_velocity
from smokelift.evaluation import metrics
from smokelift.evaluation.frame_means import PictureMeans
from smokelift.evaluation.truth import Truth, resampled
from smokelift.render import scene_renderer
from smokelift.transport import Array, Velocity, on_faces


def true_moment(truth: Truth, frame: int) -> SmokeState:
    """Return a moment of the truth, from frame 1."""
    velocity = replace(truth.velocity(frame - 1), closed=truth.closed)
    return SmokeState(truth.density(frame), complete_velocity(velocity))


def reconstructed_moment(folder: Path, truth: Truth, frame: int) -> SmokeState:
    """Return a moment of a run of `benchmarks.accuracy`, from frame 1."""
    with np.load(folder / f"{frame + 1:04d}.npz") as file:
        density, centres = (file[name].astype(np.float32) for name in ("density", "velocity"))
    voxel_size = truth.voxel_size * truth.shape[0] / density.shape[0]
    return SmokeState(density, complete_velocity(Velocity(on_faces(centres), voxel_size, truth.closed)))


def picture_psnr(known: KnownScene, densities: Sequence[Array], frames: Sequence[int], run: str, folder: Path) -> float:
    """Return the PSNR (dB) of densities in the views that are not the input's, over some frames of a scene."""
    about: KnownDensities | None = known_densities(known, run, folder)
    assert about is not None
    means = PictureMeans()
    for view, camera in list(known.cameras.items())[1:]:
        renderer = scene_renderer(about.scene, camera, BLACK)
        for frame, density in zip(frames, densities, strict=True):
            means.add(renderer.image(density), known.seen(view, frame))
    return float(means.figures()["psnr"])


def density_error(found: Array, true: Array) -> float:
    """Return the relative error of a density, on the true one's grid."""
    nx, ny, nz = true.shape
    return metrics.volume_error(resampled(found, (nx, ny, nz)), true)
