"""What an unfinished run needs to go on: its last frame at full precision, which OpenVDB's 16 bits do not hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.output.archive import VELOCITY, Shape, read_arrays, write_arrays
from smokelift.transport import Array, Faces, face_shapes, halved

_EXTRA = "extra_"


@dataclass(frozen=True)
class ResumeState:
    """What a reconstruction carries from one frame to the next.

    Attributes
    ----------
    number
        The last finished frame.
    density : (nx, ny, nz)
    velocity
        On faces, m/s; the grid may be coarser than that of the density.
    extra
        Further arrays by name.
    """

    number: int
    density: Array
    velocity: Faces
    extra: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)

    def write(self, path: Path) -> None:
        """Write the state; OSError if that fails."""
        velocity = dict(zip(VELOCITY, self.velocity, strict=True))
        extra = {f"{_EXTRA}{name}": value for name, value in self.extra.items()}
        arrays = {"number": np.array(self.number), "density": self.density, **velocity, **extra}
        write_arrays(path, arrays, compressed=False)

    @staticmethod
    def read(path: Path, shape_of: Callable[[int], tuple[int, int, int]]) -> ResumeState | None:
        """Read the state, or return None if no frame was finished.

        Parameters
        ----------
        path
            The file.
        shape_of
            Gives the voxels of a frame, by its number.

        Raises
        ------
        OSError
            If the file is damaged.
        """
        if not path.is_file():
            return None
        shape = shape_of(int(read_arrays(path, {"number": ()})["number"]))
        expected: dict[str, Shape | None] = {"number": (), "density": shape, **dict.fromkeys(VELOCITY)}
        arrays = read_arrays(path, expected, others={_EXTRA: shape})
        number, density = arrays.pop("number"), arrays.pop("density")
        x, y, z = (arrays.pop(name) for name in VELOCITY)
        extra = {name.removeprefix(_EXTRA): value for name, value in arrays.items()}
        if number.dtype.kind != "i" or number < 0 or density.min() < 0:
            raise OSError(f"{path}: cannot be read: number or density is negative")
        if (x.shape, y.shape, z.shape) not in _grids(shape):
            raise OSError(
                f"{path}: cannot be read: the grid of its velocity does not fit its density; choose another directory"
            )
        return ResumeState(int(number), density, (x, y, z), extra)


def _grids(shape: tuple[int, int, int]) -> list[tuple[tuple[int, int, int], ...]]:
    """Shapes of a velocity on the grid of a density, and on those that are each half as fine."""
    shapes = [shape]
    while max(shapes[-1]) > 1:
        shapes.append(halved(shapes[-1]))
    return [face_shapes(coarser) for coarser in shapes]
