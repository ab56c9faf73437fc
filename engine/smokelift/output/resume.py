"""What an unfinished run needs to go on: its last frame at full precision, which OpenVDB's 16 bits do not hold."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.output.archive import VELOCITY, Shape, read_arrays, write_arrays
from smokelift.transport import Array, Faces, face_shapes, halved

_EXTRA = "extra_"

_VOXELS = "_voxels"
"""Ends the name of the bits that say where an array is not 0, by which its values alone are written: most of a large
grid is empty."""


@dataclass(frozen=True)
class ResumeState:
    """What a reconstruction carries from one frame to the next."""

    number: int
    """The last finished frame."""
    density: Array
    """(nx, ny, nz): at voxel centers."""
    velocity: Faces
    """On faces, m/s; the grid may be coarser than that of the density."""
    extra: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    """(nx, ny, nz) each: further volumes by name."""

    def write(self, path: Path) -> None:
        """Write the state; OSError if that fails."""
        arrays = {"number": np.array(self.number), **dict(zip(VELOCITY, self.velocity, strict=True))}
        volumes = {"density": self.density, **{_EXTRA + name: values for name, values in self.extra.items()}}
        for name, values in volumes.items():
            there = values != 0
            arrays |= {name: values[there], name + _VOXELS: np.packbits(there.ravel())}
        write_arrays(path, arrays, compressed=False)

    @staticmethod
    def last_number(path: Path) -> int | None:
        """The number of the last finished frame; None if there is no state, OSError if the file is damaged."""
        return int(read_arrays(path, {"number": ()})["number"]) if path.is_file() else None

    @staticmethod
    def read(path: Path, shape: tuple[int, int, int]) -> "ResumeState":
        """Read the state of a frame of so many voxels; OSError if there is none, or the file is damaged."""
        arrays = read_arrays(
            path,
            {"number": (), **dict.fromkeys(VELOCITY)},
            others=dict.fromkeys(("density", _EXTRA), (math.prod(shape),)),
        )
        number = arrays.pop("number")
        x, y, z = (arrays.pop(name) for name in VELOCITY)
        try:
            volumes = {name: _dense(arrays, name, shape) for name in arrays if not name.endswith(_VOXELS)}
            density = volumes.pop("density")
        except (KeyError, TypeError, ValueError) as error:
            raise OSError(f"{path}: cannot be read: what it says of its voxels does not fit") from error
        if number.dtype.kind != "i" or number < 0 or density.min() < 0:
            raise OSError(f"{path}: cannot be read: its number or density is not one that a run writes")
        grids = [shape]  # that of the density, and those that are each half as fine
        while max(grids[-1]) > 1:
            grids.append(halved(grids[-1]))
        if all(face_shapes(grid) != (x.shape, y.shape, z.shape) for grid in grids):
            raise OSError(
                f"{path}: cannot be read: the grid of its velocity does not fit its density; choose another directory"
            )
        extra = {name.removeprefix(_EXTRA): values for name, values in volumes.items()}
        return ResumeState(int(number), density, (x, y, z), extra)


def _dense(arrays: Mapping[str, npt.NDArray[Any]], name: str, shape: Shape) -> npt.NDArray[Any]:
    """Give the volume of that name, zeros included; KeyError, TypeError or ValueError if its parts do not fit."""
    there = np.unpackbits(arrays[name + _VOXELS], count=math.prod(shape)).view(bool).reshape(shape)
    filled = np.zeros(shape, arrays[name].dtype)
    filled[there] = arrays[name]
    return filled
