"""NumPy archives that appear whole or not at all, and are read only if they are sound.

One of them holds what an unfinished run needs to go on: its last frame at full precision, which OpenVDB's 16 bits do
not hold.
"""

import math
import operator
import zipfile
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from smokelift.checks import MAX_MAGNITUDE
from smokelift.checks.whole_files import atomic_path
from smokelift.transport import Array, Faces, face_shapes, halved

Shape = tuple[int, ...]

NUMBERS = "biuf"
"""NumPy's kinds of real numbers."""

VELOCITY = ("velocity_x", "velocity_y", "velocity_z")
"""Names of the components of a velocity on faces."""

FLAME = "flame"
"""Name of the emission of fire, which is there only where a clip shows fire."""

MAX_VALUES = 2**32
"""Values of an array whose shape is not known before, at most."""

_EXTRA = "extra_"

_VOXELS = "_voxels"
"""Ends the name of the bits that say where an array is not 0, by which its values alone are written: most of a large
grid is empty."""


def write_arrays(path: Path, arrays: Mapping[str, npt.NDArray[Any]], *, compressed: bool = True) -> None:
    """Write arrays by name as a ``.npz``, one after the other: copies of all may not fit into memory."""
    kind = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    # not by NumPy, which an interrupt leaves with an open zip file that raises a second error when it is collected
    with atomic_path(path) as temporary, temporary.open("wb") as file, zipfile.ZipFile(file, "w", kind) as archive:
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)  # type: ignore[no-untyped-call]  # NumPy's


def read_arrays(
    path: Path,
    expected: Mapping[str, Shape | None],
    *,
    others: Mapping[str, Shape] | None = None,
    text: Collection[str] = (),
) -> dict[str, npt.NDArray[Any]]:
    """Read arrays of real, finite numbers from a ``.npz``.

    It must hold those that are expected, with their shapes where these are known. It may hold others, by beginnings
    of their names, with the most values along each axis; those named in ``text`` hold text. Sizes are compared with
    what the file really holds, and with what is expected, before memory is taken. An OSError has the path and the
    reason, if it is missing or damaged, lacks an array, or holds others than expected.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
    try:
        with zipfile.ZipFile(path) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            arrays = {}
            for name, shape in expected.items():
                if name not in members:
                    raise ValueError(f"it lacks {name}")
                arrays[name] = _array(archive, members[name], NUMBERS, exactly=shape)
            for start, most in (others or {}).items():
                for name in members:
                    if name.startswith(start):
                        arrays[name] = _array(
                            archive, members[name], at_most=most, kinds="U" if name in text else NUMBERS
                        )
            return arrays
    except MemoryError:
        raise
    # A damaged archive fails in zipfile, in any decompressor, in Python's parser or in NumPy, each with errors of
    # its own; to the caller they all say the same.
    except Exception as error:
        is_archive = zipfile.is_zipfile(path)
        reason = " ".join(str(error).split()) if is_archive else "it is no NumPy archive (.npz), or cut short"
        raise OSError(f"{path}: cannot be read: {reason}") from error


def _array(
    archive: zipfile.ZipFile,
    info: zipfile.ZipInfo,
    kinds: str,
    exactly: Shape | None = None,
    at_most: Shape | None = None,
) -> npt.NDArray[Any]:
    read_header: dict[tuple[int, int], Callable[[IO[bytes]], tuple[Shape, bool, np.dtype[Any]]]] = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    with archive.open(info) as file:
        shape, _, kind = read_header[np.lib.format.read_magic(file)](file)  # type: ignore[no-untyped-call]  # NumPy's
    if kind.kind not in kinds:
        raise ValueError(f"{info.filename} holds {kind}")
    count = math.prod(shape)
    within = at_most is None or (len(shape) <= len(at_most) and all(map(operator.le, shape, at_most)))
    unexpected = exactly not in (None, shape) or not within
    if unexpected or count > MAX_VALUES or count * kind.itemsize > info.file_size:
        raise ValueError(f"{info.filename} cannot have the shape {shape}")
    with archive.open(info) as file:
        values: npt.NDArray[Any] = np.lib.format.read_array(file)  # type: ignore[no-untyped-call]  # NumPy's
    # as a float of Python, since 16 bits cannot hold the bound
    if kind.kind == "f" and values.size and not float(np.abs(values).max()) <= MAX_MAGNITUDE:
        raise ValueError(f"{info.filename} holds values that are not finite, or beyond {MAX_MAGNITUDE:g}")
    return values


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
