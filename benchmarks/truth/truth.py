"""Scenes whose flow is known: the files that bake.py writes, and others in their format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from smokelift.transport import Side, Velocity

Array = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Truth:
    """Densities, velocities and inlet of one scene.

    Attributes
    ----------
    densities
        float16 [frame, x, y, z]; a density times the medium's extinction is in 1/m.
    faces
        Velocities (m/s) on x, y and z faces, float16 [frame, x, y, z]; those of frame f carry density f to f + 1, at
        the points of arrival. Known within 6 voxels of smoke, zero elsewhere.
    inflow_packed
        np.packbits of the cells where smoke was put into the density of a frame, [frame, byte].
    voxel_size
        Edge of a voxel (m).
    fps
        Frames a second.
    closed
        Names of the sides that are walls.
    """

    densities: npt.NDArray[np.float16]
    faces: tuple[npt.NDArray[np.float16], ...]
    inflow_packed: npt.NDArray[np.uint8]
    voxel_size: float
    fps: float
    closed: tuple[Side, ...]

    @staticmethod
    def load(path: Path) -> Truth:
        """Read a truth.npz."""
        with np.load(path) as file:
            return Truth(
                densities=file["density"],
                faces=tuple(file[f"velocity_{axis}"] for axis in "xyz"),
                inflow_packed=file["inflow_packed"],
                voxel_size=float(file["voxel_size"]),
                fps=float(file["fps"]),
                closed=tuple(file["closed"].tolist()) if "closed" in file else (),
            )

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
