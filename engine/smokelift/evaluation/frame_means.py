"""Metrics of every frame, and their means over the frames: pictures and volumes beside the true ones."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.evaluation import metrics
from smokelift.evaluation.resampling import resampled
from smokelift.evaluation.truth import Truth
from smokelift.footage.images import area_average, linear_to_srgb
from smokelift.render import Image, Volume
from smokelift.transport import Array

Figures = dict[str, Any]

SMOKE = 0.01
"""Share of a frame's largest true density above which a voxel counts as smoke."""

AROUND = 2
"""Voxels around the smoke in which a velocity still matters: advection and motion blur reach there."""

BLOCKS = 16
"""Blocks along a picture's longer side for its flicker: coarser than any motion from frame to frame."""


class PictureMeans:
    """Pictures from one camera beside the true ones, in 8-bit sRGB values over the whole picture.

    Parameters
    ----------
    background : (rows, columns, 3) or (3,)
        Linear radiance behind the smoke, of both.
    """

    def __init__(self, background: Image) -> None:
        self._background = eight_bit_values(background)
        self._frames: list[Figures] = []
        self._power: list[npt.NDArray[np.float64]] = []
        self._power_truth: list[npt.NDArray[np.float64]] = []
        self._blocks: list[Array] = []
        self._blocks_truth: list[Array] = []

    def add(self, image: Image, truth: Image) -> Figures:
        """Add a frame, linear radiance (rows, columns, 3), and return its own metrics.

        Raises
        ------
        ValueError
            If the shapes differ or a value is not finite.
        """
        found, true = eight_bit_values(image), eight_bit_values(truth)
        smoke, true_smoke = found - self._background, true - self._background
        shifted, shift = metrics.shifted_psnr(smoke, true_smoke)
        figures = {
            "psnr": metrics.psnr(found, true),
            "ssim": metrics.ssim(found, true),
            "psnr_shifted": shifted,
            "shift": list(shift),
        }
        grey, true_grey = smoke.mean(axis=-1), true_smoke.mean(axis=-1)
        self._power.append(metrics.octave_power(grey))
        self._power_truth.append(metrics.octave_power(true_grey))
        self._blocks.append(_blocks(grey))
        self._blocks_truth.append(_blocks(true_grey))
        self._frames.append(figures)
        return figures

    def figures(self) -> Figures:
        """Means over the frames (of decibels, those that are finite), spectrum and flicker of them all."""
        distance, octaves = None, None
        if np.sum(self._power_truth) > 0:
            distance, ratios = metrics.spectrum_distance(sum(self._power), sum(self._power_truth))
            octaves = ratios.tolist()
        return {
            **{name: finite_mean(f[name] for f in self._frames) for name in ("psnr", "ssim", "psnr_shifted")},
            "spectrum_distance": distance,
            "spectrum_octaves": octaves,
            "flicker": _flicker(self._blocks),
            "flicker_truth": _flicker(self._blocks_truth),
        }


class VolumeMeans:
    """Densities and velocities beside the true ones, on the truth's grid.

    Parameters
    ----------
    truth
        What they should be.
    """

    def __init__(self, truth: Truth) -> None:
        self._truth = truth
        self._frames: list[Figures] = []
        self._layers: list[Array] = []
        self._layers_truth: list[Array] = []
        self._before: tuple[int, Volume] | None = None

    def add(self, frame: int, density: Volume, velocity: Array | None = None) -> Figures:
        """Add a frame and return its own metrics.

        Parameters
        ----------
        frame
            Of the truth, from 0, in order.
        density
            Shape (nx, ny, nz), of any resolution over the truth's box.
        velocity
            In m/s at the voxels' centres, shape (nx, ny, nz, 3), of the smoke that arrives in this frame. Compared from
            the second frame on.

        Raises
        ------
        ValueError
            If a value is not finite.
        """
        truth = self._truth
        found, true = resampled(density, truth.shape), truth.density(frame)
        figures: Figures = {
            "density_error": metrics.volume_error(found, true),
            "height_mass_error": metrics.height_mass_error(found, true),
            "mass_ratio": float(found.sum(dtype=float) / max(true.sum(dtype=float), 1e-30)),
        }
        smoke = true > SMOKE * true.max()
        before, self._before = self._before, (frame, found)
        if velocity is not None and before is not None and before[0] == frame - 1 and smoke.any():
            figures |= self._motion(frame, before[1], found, resampled(velocity, truth.shape), smoke)
        self._layers.append(found.sum(axis=(0, 1)))
        self._layers_truth.append(true.sum(axis=(0, 1)))
        self._frames.append(figures)
        return figures

    def _motion(
        self, frame: int, before: Volume, after: Volume, velocity: Array, smoke: npt.NDArray[np.bool_]
    ) -> Figures:
        """Metrics of what moves the density of the frame before into this one's, at the points of arrival."""
        truth = self._truth
        true_velocity = truth.velocity(frame - 1).centres()
        free = ~(truth.inflow(frame - 1) | truth.inflow(frame))
        inside, around = smoke & free, ndimage.binary_dilation(smoke, iterations=AROUND) & free
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

    def figures(self) -> Figures:
        """Means over the frames that are finite, and the flicker of the mass in every layer."""
        names = dict.fromkeys(name for figures in self._frames for name in figures)
        return {
            **{name: finite_mean(f[name] for f in self._frames if name in f) for name in names},
            "flicker": _flicker(self._layers),
            "flicker_truth": _flicker(self._layers_truth),
        }


def eight_bit_values(image: npt.ArrayLike) -> Array:
    """Linear radiance as the sRGB values (1 is white) that an 8-bit picture holds."""
    return np.asarray(np.rint(255 * np.clip(linear_to_srgb(image), 0, 1)) / 255, np.float32)


def finite_mean(values: Iterable[float]) -> float | None:
    """The mean of what is finite (equal pictures have infinite decibels); None where nothing is."""
    finite = [value for value in values if np.isfinite(value)]
    return float(np.mean(finite)) if finite else None


def _blocks(grey: Array) -> Array:
    rows, columns = grey.shape
    edge = max(rows, columns) / BLOCKS
    return area_average(grey, max(1, round(columns / edge)), max(1, round(rows / edge)))


def _flicker(series: list[Array]) -> float | None:
    if len(series) < 3:
        return None
    value = metrics.flicker(np.stack(series))
    return value if np.isfinite(value) else None
