"""OpenVDB files with their grids, units and signs, as Blender or another host expects them.

A file has a fog volume `density`, a vector grid `velocity` in m/s, and where a clip shows fire a fog volume `flame`:
its emission, radiance per meter, in one channel.

There is no standalone package of OpenVDB for Python. The vdb extra installs bpy, whose wheel contains one in a folder
that is not on `sys.path`. bpy itself is never imported.

OpenVDB puts the value of voxel (i, j, k) at its integer coordinates, so the transform sends (i, j, k) to the
voxel's center, `min + (i + 1/2) h`.
"""

import importlib
import importlib.util
import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.checks import densities
from smokelift.checks.whole_files import atomic_path
from smokelift.output.archive import FLAME
from smokelift.scene import Domain
from smokelift.scene.domain import box_around
from smokelift.transport import Array, StaggeredGrid, at_centres, block_means, faces_in
from smokelift.transport.grid import finite

HostName = Literal["blender", "houdini", "unreal"]

Axes = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]

VELOCITY_MARGIN = 2
"""Voxels around the smoke in which velocity is kept: motion blur reads it beyond the edge."""

SLAB = 64
"""Voxels along x whose velocity is written at once, as many as eight leaves of OpenVDB's tree hold."""

PROXY_TIMES = 4
"""How many times as large the voxels of a proxy are, a coarse copy that viewports read in the place of large files."""

MIN_PROXY_VOXELS = 4_000_000
"""Voxels of a box from which on a run writes proxies. Blender reads a frame of 41 million, a quarter of them smoke, in
1.2 s (measured by `benchmarks/blender/heavy.py`, two cores), so of so many it reads 8 a second."""

SETTINGS = "smokelift_settings"
"""Name of the grid metadata that holds the settings as JSON."""

_LIMIT = np.float32(np.finfo(np.float16).max)
"""Largest value that is stored."""

_SPARE_BYTES = 65536
"""Bytes that are written after a file and taken away again, to see whether the disk is full."""


@dataclass(frozen=True)
class Host:
    """What a program expects."""

    velocity: str = "velocity"
    """Name of the grid of the velocity."""
    up_axis: str = "Z"
    """``"Z"`` or ``"Y"``."""
    axes: Axes = ((0, 1), (1, 1), (2, 1))
    """For each of the program's axes ours, and 1, or -1 where it points the other way."""
    left_handed: bool = False
    """Whether these axes mirror the smoke."""
    eight_bits: bool = False
    """Whether it keeps densities from 0 to 1 in 8 bits: they are divided by the largest of the sequence."""
    whole_box: bool = False
    """Whether it puts the pivot at the corner of what is active: then the box's corners are, in every frame."""

    def box(self, domain: Domain) -> Domain:
        """The box of the smoke in the program's axes."""
        ends = [sorted((sign * domain.min[axis], sign * domain.max[axis])) for axis, sign in self.axes]
        (x0, x1), (y0, y1), (z0, z1) = ends
        nx, ny, nz = (domain.resolution[axis] for axis, _ in self.axes)
        return Domain((x0, y0, z0), (x1, y1, z1), (nx, ny, nz))

    def turned(self, values: Array) -> Array:
        """A volume, or the vectors of one (x, y, z, 3), in the program's axes."""
        order = [axis for axis, _ in self.axes]
        turned = values.transpose(*order, *range(3, values.ndim))
        turned = turned[tuple(slice(None, None, sign) for _, sign in self.axes)]
        return (
            turned if values.ndim == 3 else turned[..., order] * np.array([sign for _, sign in self.axes], np.float32)
        )


BLENDER = Host()

HOSTS: Mapping[HostName, Host] = {
    "blender": BLENDER,
    "houdini": Host(velocity="vel", up_axis="Y", axes=((0, 1), (2, 1), (1, -1))),
    "unreal": Host(axes=((0, 1), (1, -1), (2, 1)), left_handed=True, eight_bits=True, whole_box=True),
}
"""Hosts by the name of the program. Unreal's importer (5.4) takes voxels for those of its left-handed axes, the corner
of the box around all active voxels of a sequence for the pivot, and a grid ``density`` for 8 bits from 0 to 1 (by
definition)."""


class VdbUnavailable(RuntimeError):  # noqa: N818  (it says what is the matter better than ...Error)
    """No OpenVDB module can be found."""


@cache
def vdb_module() -> ModuleType:
    """Return the OpenVDB module, looking inside an installed bpy wheel if need be.

    Without one it raises VdbUnavailable, which says what to install.
    """
    for name in ("openvdb", "pyopenvdb"):
        try:
            return importlib.import_module(name)
        except ImportError:
            continue
    for folder in _bpy_folders():
        sys.path.insert(0, str(folder))
        try:
            return importlib.import_module("openvdb")
        except ImportError:
            continue
        finally:
            sys.path.remove(str(folder))
    raise VdbUnavailable(
        "no OpenVDB module was found: install one with \"pip install 'smokelift[vdb]'\" (for Python 3.11 and "
        "3.13; there is none for 3.12)"
    )


def _bpy_folders() -> list[Path]:
    """Return the module folders inside an installed bpy wheel, for the running Python."""
    found = importlib.util.find_spec("bpy")
    if found is None or not found.submodule_search_locations:
        return []
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    places = [Path(place) for place in found.submodule_search_locations]
    # Linux and macOS wheels have lib/pythonX.Y, Windows ones only lib.
    patterns = (f"*/python/lib/{version}/site-packages", "*/python/lib/site-packages")
    return [folder for place in places for pattern in patterns for folder in sorted(place.glob(pattern))]


def write_vdb(
    path: str | Path,
    density: npt.ArrayLike,
    velocity: npt.ArrayLike | StaggeredGrid | None,
    domain: Domain,
    settings: Mapping[str, Any] | None = None,
    flame: npt.ArrayLike | None = None,
    *,
    metadata: Mapping[str, str | float] | None = None,
    host: Host = BLENDER,
    lattice: Domain | None = None,
) -> None:
    """Write one frame; the file appears whole or not at all.

    Values are stored as 16 bit floats, which have three digits; larger values are clipped. Density (nx, ny, nz), and
    the flame's emission (nx, ny, nz) in radiance per meter, are not negative and stored where they are not zero. The
    velocity in m/s, on faces or at voxel centers (nx, ny, nz, 3), is stored within `VELOCITY_MARGIN` voxels of density.
    Without velocity or flame there is no such grid.

    The settings are kept with the density grid, as JSON can hold them, and every grid gets the metadata. The host names
    the grid of the velocity, and says whether two opposite corners of the box are active although there is no smoke;
    the axes of the volumes are its own already. The first voxel of the lattice, by default `domain`, has the index
    (0, 0, 0); its voxels are in line with those of `domain`. All frames of a sequence share one, because a host mixes
    grids with one transform only.

    It raises ValueError if a shape does not fit the domain, a value is not finite, or a density or an emission
    negative; VdbUnavailable if there is no OpenVDB module, and OSError if the file cannot be written.
    """
    vdb = vdb_module()
    rho = densities(density, "density", domain.shape, np.inf)
    box = _around(rho > 0.0, VELOCITY_MARGIN)
    if velocity is not None:
        velocity = _checked_velocity(velocity, domain.shape)
    lattice = lattice or domain
    first = domain.first_in(lattice)
    rho_box, corner = rho[box], _index(box, first)
    grids = {"density": _fog(vdb, rho_box, corner)}
    if velocity is not None:
        grids[host.velocity] = vdb.Vec3SGrid()
        for slab, near in _near(rho_box, velocity, box):
            grids[host.velocity].copyFromArray(near, ijk=_index(slab, first))
    if flame is not None:
        emission = densities(flame, FLAME, domain.shape, np.inf)
        box = _around(emission > 0.0, 0)
        grids[FLAME] = _fog(vdb, emission[box], _index(box, first))
    h = lattice.voxel_size
    x, y, z = (low + 0.5 * h for low in lattice.min)
    for name, grid in grids.items():
        grid.name = name
        grid.creator = "Smokelift"
        grid.saveFloatAsHalf = True
        # The binding's default tolerance does not fit vector grids, so it is spelt out.
        grid.prune(tolerance=grid.zeroValue)
        grid.transform = vdb.createLinearTransform([[h, 0, 0, 0], [0, h, 0, 0], [0, 0, h, 0], [x, y, z, 1]])
        for key, value in (metadata or {}).items():
            grid[key] = value
        last = tuple(i + n - 1 for i, n in zip(first, domain.shape, strict=True))
        for corner in (first, last) if host.whole_box else ():
            grid.getAccessor().setActiveState(corner, True)
    if settings is not None:
        grids["density"][SETTINGS] = json.dumps(dict(settings), sort_keys=True)
    with atomic_path(path) as temporary:
        try:
            vdb.write(str(temporary), grids=list(grids.values()))
        except RuntimeError as error:
            raise OSError(f"{path}: cannot be written: {error}") from error
        _ensure_written(temporary)


def write_proxy(
    path: Path,
    density: Array,
    domain: Domain,
    times: int = PROXY_TIMES,
    flame: Array | None = None,
    lattice: Domain | None = None,
) -> None:
    """Write the coarse copy of a frame: its density, and its emission where it has one, (nx, ny, nz) each.

    The voxels of the copy are `times` as large as those of the domain. A `lattice` as in `write_vdb` begins a multiple
    of `times` voxels before the domain, if it is not the same. It raises VdbUnavailable, and OSError if the file cannot
    be written.
    """
    fire = None if flame is None else block_means(flame, times)
    coarse_lattice = None if lattice is None else lattice.coarser(times)
    write_vdb(path, block_means(density, times), None, domain.coarser(times), flame=fire, lattice=coarse_lattice)


def _fog(vdb: ModuleType, values: Array, corner: tuple[int, ...]) -> Any:
    """A fog volume of values that begin at a voxel."""
    grid = vdb.FloatGrid()
    grid.copyFromArray(np.minimum(values, _LIMIT), ijk=corner)
    grid.gridClass = vdb.GridClass.FOG_VOLUME
    return grid


def _checked_velocity(velocity: npt.ArrayLike | StaggeredGrid, voxels: tuple[int, ...]) -> Array | StaggeredGrid:
    """A velocity on faces, or at centers as float32; ValueError if it does not fit the voxels, or is not finite."""
    parts: tuple[Array, ...]
    shape: tuple[int, ...]
    if isinstance(velocity, StaggeredGrid):
        parts, shape = velocity.faces, (*velocity.shape, 3)
    else:
        velocity = np.ascontiguousarray(velocity, np.float32)
        parts, shape = (velocity,), velocity.shape
    if shape != (*voxels, 3):
        raise ValueError(f"velocity {shape} does not fit the domain's {voxels} voxels; resample it")
    if not all(map(finite, parts)):
        raise ValueError("velocity must be finite; set other values to 0")
    return velocity


def _near(
    rho: Array, velocity: Array | StaggeredGrid, box: tuple[slice, ...]
) -> Iterator[tuple[tuple[slice, ...], Array]]:
    """The velocity (x, y, z, 3) that is stored in a box of density, none away from smoke, slab by slab.

    All of the box's at once takes more memory than the frame.
    """
    near = rho > 0.0
    if near.any():
        near = ndimage.maximum_filter(near, 2 * VELOCITY_MARGIN + 1, mode="constant")
    for start in range(0, len(near), SLAB):
        there = near[start : start + SLAB]
        slab = (slice(box[0].start + start, box[0].start + start + len(there)), *box[1:])
        if isinstance(velocity, StaggeredGrid):
            part = np.stack(at_centres(faces_in(velocity.faces, slab)), axis=-1)
        else:
            part = velocity[slab].copy()
        np.copyto(part, np.float32(0.0), where=~there[..., None])
        yield slab, np.clip(part, -_LIMIT, _LIMIT, out=part)


def _index(box: tuple[slice, ...], first: tuple[int, ...]) -> tuple[int, ...]:
    """The index of a box's first voxel in a file, where the domain's first has the index `first`."""
    return tuple(side.start + start for side, start in zip(box, first, strict=True))


def _around(marked: npt.NDArray[np.bool_], margin: int) -> tuple[slice, ...]:
    """The box around the marked voxels; all of the grid without any, as OpenVDB takes no empty array."""
    return box_around(marked, margin) if marked.any() else tuple(slice(0, n) for n in marked.shape)


def _ensure_written(path: Path) -> None:
    """Raise OSError if the disk is full: OpenVDB silently cuts the file short then."""
    size = path.stat().st_size
    with path.open("r+b", buffering=0) as file:
        file.seek(size)
        file.write(bytes(_SPARE_BYTES))
        file.truncate(size)


def read_grid(path: str | Path, name: str, domain: Domain) -> Array | None:
    """Read a grid, (nx, ny, nz) float32, that :func:`write_vdb` wrote; None if the file has none of that name.

    The name is ``"density"``, ``"flame"`` or ``"velocity"``, which is (nx, ny, nz, 3) in m/s. The box that is read has
    voxels in line with those of the file; where nothing is stored they are zero. It raises OSError if the file is
    missing or damaged, and VdbUnavailable.
    """
    vdb = vdb_module()
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    values = np.zeros((*domain.shape, 3) if name == "velocity" else domain.shape, np.float32)
    h = domain.voxel_size
    try:
        if not any(grid.name == name for grid in vdb.readAllGridMetadata(str(path))):
            return None
        grid = vdb.read(str(path), gridname=name)
        origin = grid.transform.indexToWorld((0, 0, 0))
        corner = tuple(round((low + 0.5 * h - at) / h) for low, at in zip(domain.min, origin, strict=True))
        grid.copyToArray(values, ijk=corner)
    except (OSError, RuntimeError, LookupError, TypeError) as error:
        raise OSError(f"{path}: is damaged: {error}") from error
    return values
