"""Scenes whose flow is known, as benchmarks/truth/bake.py writes them, and volumes on their grid."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from smokelift.checks import Array
from smokelift.footage.images import area_average
from smokelift.output.archive import VELOCITY, Shape, read_arrays
from smokelift.scene import SIDES, CompleteScene, Side
from smokelift.scene.domain import checked_sides
from smokelift.transport import Velocity, face_shapes


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
