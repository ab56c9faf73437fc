"""Scenes whose flow is known, as benchmarks/truth/bake.py writes them, and metrics of frames beside the true ones."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.evaluation import metrics
from smokelift.footage.images import area_average
from smokelift.output.archive import VELOCITY, Shape, read_arrays
from smokelift.output.images import eight_bit
from smokelift.render import Image, Volume
from smokelift.scene import SIDES, CompleteScene, Side
from smokelift.scene.domain import checked_sides
from smokelift.transport import Array, Velocity, face_shapes

Figures = dict[str, Any]

SMOKE_FRACTION = 0.01
"""Fraction of a frame's largest true density above which a voxel counts as smoke."""

SURROUNDING_VOXELS = 2
"""Voxels around the smoke in which a velocity still matters: advection and motion blur reach there."""


class TruthError(ValueError):
    """A file that holds no truth, and why."""


@dataclass(frozen=True, eq=False)
class Truth:
    """Densities, velocities and inlet of one scene."""

    densities: npt.NDArray[np.float16]
    """float16 [frame, x, y, z]; a density times the medium's extinction is in 1/m."""
    faces: tuple[npt.NDArray[np.float16], ...]
    """Velocities (m/s) on x, y and z faces, float16 [frame, x, y, z]; those of frame f carry density f to f + 1, at the
    points of arrival. Known within 6 voxels of smoke, zero elsewhere."""
    inflow_packed: npt.NDArray[np.uint8]
    """np.packbits of the cells where smoke was put into the density of a frame, [frame, byte]."""
    voxel_size: float
    """Edge of a voxel (m)."""
    fps: float
    """Frames per second."""
    closed: tuple[Side, ...]
    """Names of the sides that are walls."""

    @staticmethod
    def load(path: Path) -> "Truth":
        """Read a truth.npz; TruthError if there is no such file, it is damaged, or it holds something else."""
        wanted: dict[str, Shape | None] = dict.fromkeys(("density", *VELOCITY, "inflow_packed"))
        wanted |= {"voxel_size": (), "fps": ()}
        try:
            file = read_arrays(path, wanted, others={"closed": (len(SIDES),)}, text={"closed"})
            truth = Truth(
                densities=file["density"],
                faces=tuple(file[name] for name in VELOCITY),
                inflow_packed=file["inflow_packed"],
                voxel_size=float(file["voxel_size"]),
                fps=float(file["fps"]),
                closed=checked_sides(file["closed"].tolist()) if "closed" in file else (),
            )
        except (OSError, ValueError) as error:
            raise TruthError(f"{error}.") from error
        truth._check(path)
        return truth

    def _check(self, path: Path) -> None:
        if self.densities.ndim != 4 or 0 in self.densities.shape:
            raise TruthError(f"{path}: density must be [frame, x, y, z], not of shape {self.densities.shape}.")
        packed = (self.frames, -(-math.prod(self.shape) // 8))
        if self.inflow_packed.shape != packed or self.inflow_packed.dtype != np.uint8:
            raise TruthError(f"{path}: inflow_packed must be bytes of shape {packed}, not {self.inflow_packed.shape}.")
        wanted = [(self.frames, *shape) for shape in face_shapes(self.shape)]
        if (found := [face.shape for face in self.faces]) != wanted:
            raise TruthError(f"{path}: velocity on faces must have the shapes {wanted}, not {found}.")
        if not (self.voxel_size > 0 and self.fps > 0):
            raise TruthError(f"{path}: voxel_size and fps must be positive, not {self.voxel_size} and {self.fps}.")

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.densities)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along x, y and z."""
        nx, ny, nz = self.densities.shape[1:]
        return nx, ny, nz

    @property
    def dt(self) -> float:
        """Seconds from one frame to the next."""
        return 1 / self.fps

    def density(self, frame: int) -> Array:
        """Density of a frame, [x, y, z]."""
        return np.asarray(self.densities[frame], np.float32)

    def velocity(self, frame: int) -> Velocity:
        """What carries the density of a frame to the next one."""
        x, y, z = (component[frame].astype(np.float32) for component in self.faces)
        return Velocity((x, y, z), self.voxel_size)

    def inflow(self, frame: int) -> npt.NDArray[np.bool_]:
        """Cells where smoke was put into the density of a frame, [x, y, z]."""
        count = int(np.prod(self.shape))
        return np.unpackbits(self.inflow_packed[frame], count=count).reshape(self.shape).astype(bool)


def on_grid(scene: CompleteScene, shape: tuple[int, int, int]) -> CompleteScene:
    """Return a scene whose box has so many voxels."""
    return replace(scene, domain=replace(scene.domain, resolution=shape))


def resampled(values: Array, shape: tuple[int, int, int]) -> Array:
    """Return a volume (nx, ny, nz, ...) on another grid over the same box.

    Along an axis where that is coarser its values are means, otherwise they are interpolated.
    """
    if values.shape[:3] == tuple(shape):
        return values
    x, y, z = shape
    rest = values.shape[3:]
    flat = area_average(values.reshape(*values.shape[:2], -1), y, x)  # two axes, then the third
    upright = np.moveaxis(flat.reshape(x, y, values.shape[2], *rest), 2, 0)
    layers = area_average(upright.reshape(values.shape[2], -1, 1), x * y * int(np.prod(rest, dtype=int)), z)
    return np.ascontiguousarray(np.moveaxis(layers.reshape(z, x, y, *rest), 0, 2))


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
