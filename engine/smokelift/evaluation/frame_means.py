"""Metrics of every frame, and their means over the frames: pictures and volumes beside the true ones."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.evaluation import metrics
from smokelift.evaluation.truth import Truth, resampled
from smokelift.output.images import eight_bit
from smokelift.render import Image, Volume
from smokelift.transport import Array

Figures = dict[str, Any]

SMOKE_FRACTION = 0.01
"""Fraction of a frame's largest true density above which a voxel counts as smoke."""

SURROUNDING_VOXELS = 2
"""Voxels around the smoke in which a velocity still matters: advection and motion blur reach there."""


def picture_figures(image: Image, truth: Image) -> Figures:
    """Metrics of a picture beside the true one, both linear radiance (rows, columns, 3), in their 8-bit sRGB values."""
    pictures = image, truth
    if all(np.array_equal(picture[..., :-1], picture[..., 1:]) for picture in pictures):
        # every figure is a mean over channels, so that one is enough where all are gray
        pictures = image[..., :1], truth[..., :1]
    found, true = map(eight_bit_values, pictures)
    return {"psnr": metrics.psnr(found, true), "ssim": metrics.ssim(found, true)}


def volume_means(truth: Truth, volumes: Iterable[tuple[int, Volume, Array | None]]) -> Figures:
    """Means over frames of the metrics of densities and velocities beside the true ones, on the truth's grid.

    Each volume is a frame of the truth, from 0, in order, with its density (nx, ny, nz), of any resolution over the
    truth's box, and the velocity (nx, ny, nz, 3), in m/s at the voxels' centers, of the smoke that arrives in it. This
    is compared from the second frame on.
    """
    frames: list[Figures] = []
    before: tuple[int, Volume] | None = None
    for frame, density, velocity in volumes:
        found, true = resampled(density, truth.shape), truth.density(frame)
        figures: Figures = {
            "density_error": metrics.volume_error(found, true),
            "height_mass_error": metrics.height_mass_error(found, true),
            "mass_ratio": float(found.sum(dtype=float) / max(true.sum(dtype=float), 1e-30)),
        }
        smoke = true > SMOKE_FRACTION * true.max()
        if velocity is not None and before is not None and before[0] == frame - 1 and smoke.any():
            figures |= _motion_figures(truth, frame, before[1], found, resampled(velocity, truth.shape), smoke)
        frames.append(figures)
        before = frame, found
    return means(frames)


def _motion_figures(
    truth: Truth, frame: int, before: Volume, after: Volume, velocity: Array, smoke: npt.NDArray[np.bool_]
) -> Figures:
    """Metrics of what moves the density of the frame before into this one's, at the points of arrival."""
    true_velocity = truth.velocity(frame - 1).centres()
    free = ~(truth.inflow(frame - 1) | truth.inflow(frame))
    inside, around = smoke & free, ndimage.binary_dilation(smoke, iterations=SURROUNDING_VOXELS) & free
    if not ndimage.binary_erosion(inside, np.ones((2, 2, 2))).any():
        return {}  # too little smoke for a divergence
    error, cosine = metrics.velocity_error(velocity, true_velocity, inside)
    error_around, cosine_around = metrics.velocity_error(velocity, true_velocity, around)
    densities = truth.density(frame - 1), truth.density(frame)
    voxels = truth.dt / truth.voxel_size
    return {
        "velocity_error": error,
        "velocity_cosine": cosine,
        "velocity_error_around": error_around,
        "velocity_cosine_around": cosine_around,
        "divergence": truth.dt * metrics.mean_divergence(velocity, truth.voxel_size, inside),
        "divergence_truth": truth.dt * metrics.mean_divergence(true_velocity, truth.voxel_size, inside),
        "warp_error": metrics.warp_error(before, after, velocity * voxels, free),
        "warp_error_truth": metrics.warp_error(*densities, true_velocity * voxels, free),
    }


def means(frames: Sequence[Figures]) -> Figures:
    """Means of each figure over the frames that have it and in which it is finite."""
    names = dict.fromkeys(name for figures in frames for name in figures)
    return {name: finite_mean(figures[name] for figures in frames if name in figures) for name in names}


def finite_mean(values: Iterable[float | None]) -> float | None:
    """The mean of what is known and finite (equal pictures have infinite decibels); None where nothing is."""
    finite = [value for value in values if value is not None and np.isfinite(value)]
    return float(np.mean(finite)) if finite else None


def eight_bit_values(image: npt.ArrayLike) -> Array:
    """Linear radiance as the sRGB values (1 is white) that an 8-bit picture holds."""
    return eight_bit(image) / np.float32(255)
