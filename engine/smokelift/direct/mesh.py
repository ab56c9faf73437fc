"""Obstacles of any shape: a surface of triangles, still or moving, the voxels that it encloses, and its speed there.

A voxel is enclosed if the surface winds around it. That is counted along the columns of voxels of each axis; a column
in which the crossings do not balance passes through a hole of the surface and says nothing, and the others decide by
majority. So parts may overlap, and a few holes do no harm (after Nooruddin and Turk 2003). OpenVDB's own voxelizer
finds the same voxels of a closed surface in as much time, but no Python 3.12 has it, and the crossings are needed for
the speed of moving faces.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.checks import Doubles, Mask
from smokelift.footage.frame_source import is_pattern, numbered_files
from smokelift.scene import Domain
from smokelift.scene.checks import LARGEST, Vector, set_fields
from smokelift.transport import Array, Faces

Integers = npt.NDArray[np.int64]

HEADER, RECORD = 84, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""Sizes in a binary STL file: bytes before the triangles, the last four of them their number, and a triangle (by
definition)."""

PAIRS_AT_ONCE = 2**20
"""Pairs of a triangle and a column in one pass, which bounds the memory."""

ORDERS = [1, 2, 0], [2, 0, 1], [0, 1, 2]
"""Axes of the columns along x, y and z: their own comes last (by definition)."""


class Crossings(NamedTuple):
    """Where triangles cross columns of voxels' centers."""

    column: Integers
    face: Integers
    side: Integers
    triangle: Integers
    """(k,): number of the column; the face between two centers in it; 1 or -1 for the side the triangle is crossed
    from; number of the triangle."""
    weights: Doubles
    """(k, 3): weights of the triangle's corners at the crossing."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface of triangles as an obstacle, at one place or, as it moves and bends, at one after another.

    Which way the triangles turn does not matter, as long as it is the same over each part.
    """

    places: npt.NDArray[np.float32]
    """(k, n, 3, 3): corners in meters, at the frame that the smoke starts from and at every frame after it; it stays at
    the last one. Of a mesh that stands still, (n, 3, 3) is enough."""

    def __post_init__(self) -> None:
        set_fields(self, places=self.places.reshape(-1, *self.places.shape[-3:]))

    @staticmethod
    def read(path: Path) -> "Mesh":
        """Read a binary STL file, in meters, Z up, or numbered ones from a pattern ``crate_####.stl`` (a # is a digit).

        A ValueError names the path if one cannot be read, is damaged or of another kind, or their numbers of
        triangles differ.
        """
        places = [_read_stl(file) for file in (numbered_files(path) if is_pattern(path) else (path,))]
        counts = [len(place) for place in places]
        if min(counts) < max(counts):
            raise ValueError(
                f"{path}: a mesh that moves has {min(counts)} to {max(counts)} triangles, but has to keep their "
                "number; leave out what changes it, or export it at one moment."
            )
        return Mesh(np.stack(places))

    @property
    def moves(self) -> bool:
        """Whether it has more than one place."""
        return len(self.places) > 1

    def bounds(self) -> tuple[Vector, Vector]:
        """The corners in meters of the box around all its places."""
        corners = self.places.reshape(-1, 3)
        (a, b, c), (d, e, f) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return (a, b, c), (d, e, f)

    def voxels(self, domain: Domain, step: int = 0) -> Mask:
        """The voxels whose centers it encloses after a step, shape (nx, ny, nz).

        It is a ValueError if it is open, such as a plane, so that it encloses nothing.
        """
        return _enclosed(_all_crossings(self._at(step), domain), domain)

    def solid(self, domain: Domain, step: int, dt: float) -> tuple[Mask, Faces]:
        """The voxels that it encloses after a step, and how fast it has moved there in m/s, on all faces.

        On a face between a voxel inside and one outside, the speed is that of the surface where it crosses the line
        between their centers; on others it is that of the nearest such face. A mesh that is open is refused by a
        ValueError.
        """
        before, now = self._at(step - 1), self._at(step)
        speeds = (now.astype(np.float64) - before) / dt
        crossings = _all_crossings(now, domain)
        x, y, z = (_on_faces(found, speeds[:, :, axis], domain, axis) for axis, found in enumerate(crossings))
        return _enclosed(crossings, domain), (x, y, z)

    def fingerprint(self) -> dict[str, Any]:
        """What distinguishes it from another in the settings of a sequence: how much it has, and a checksum."""
        checksum = hashlib.sha256(np.ascontiguousarray(self.places, "<f4").tobytes()).hexdigest()
        return {"frames": len(self.places), "triangles": self.places.shape[1], "checksum": checksum}

    def _at(self, step: int) -> npt.NDArray[np.float32]:
        return np.asarray(self.places[min(step, len(self.places) - 1)])


def _read_stl(path: Path) -> npt.NDArray[np.float32]:
    if not path.is_file():
        raise ValueError(f"{path}: is no file; give the path of a binary STL file.")
    try:
        with path.open("rb") as file:
            count = int.from_bytes(file.read(HEADER)[-4:], "little")
            whole = HEADER + count * RECORD.itemsize
            content = file.read() if path.stat().st_size == whole else b""
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror}).") from error
    if not content:
        raise ValueError(f"{path}: is no binary STL file with triangles, or damaged; export the mesh as binary STL.")
    triangles = np.frombuffer(content, RECORD)["corners"]
    if not (np.abs(triangles) <= LARGEST).all():
        raise ValueError(f"{path}: has corners that are no numbers up to {LARGEST:g} m; export the mesh again.")
    return triangles


def _all_crossings(triangles: npt.NDArray[np.float32], domain: Domain) -> list[Crossings]:
    """Where triangles cross the columns of voxels' centers along x, y and z."""
    places = (triangles.astype(np.float64) - domain.min) / domain.voxel_size - 0.5
    return [_crossings(places[:, :, order], tuple(domain.shape[d] for d in order)) for order in ORDERS]


def _enclosed(crossings: list[Crossings], domain: Domain) -> Mask:
    """The voxels around whose centers a surface winds, by the majority of the axes; ValueError if it is open."""
    votes, crossed = np.zeros(domain.shape, np.int8), False
    for order, found in zip(ORDERS, crossings, strict=True):
        shape = tuple(domain.shape[d] for d in order)
        turns = np.zeros((shape[0] * shape[1], shape[2] + 1), np.int32)
        np.add.at(turns, (found.column, found.face), found.side)
        open_columns = turns.sum(axis=1) != 0
        crossed |= bool(open_columns.any())
        vote = np.where(open_columns[:, None], 0, np.where(np.cumsum(turns[:, :-1], axis=1) != 0, 1, -1))
        votes += vote.astype(np.int8).reshape(shape).transpose(np.argsort(order))
    enclosed: Mask = votes > 0
    if crossed and not enclosed.any():
        raise ValueError("the mesh of an obstacle is open and encloses nothing; close it, or give it a thickness.")
    return enclosed


def _on_faces(crossings: Crossings, speeds: np.ndarray[Any, Any], domain: Domain, axis: int) -> Array:
    """One component of the speeds of corners (n, 3), on the faces across its axis."""
    across = [domain.shape[d] for d in ORDERS[axis][:2]]
    faces = np.full((across[0] * across[1], domain.shape[axis] + 1), np.nan, np.float32)
    faces[crossings.column, crossings.face] = (crossings.weights * speeds[crossings.triangle]).sum(axis=1)
    values = faces.reshape(*across, -1).transpose(np.argsort(ORDERS[axis]))
    unknown = np.isnan(values)
    if unknown.all():
        return np.zeros_like(values)
    nearest = ndimage.distance_transform_edt(unknown, return_distances=False, return_indices=True)
    return np.ascontiguousarray(values[tuple(nearest)])


def _crossings(places: Doubles, shape: tuple[int, ...]) -> Crossings:
    """Where triangles (n, 3, 3), in voxels from the center of the first, cross columns along the last axis."""
    limit = np.array(shape[:2]) - 1
    low = np.clip(np.ceil(places[:, :, :2].min(axis=1)), 0, limit + 1).astype(np.int64)
    high = np.clip(np.floor(places[:, :, :2].max(axis=1)), -1, limit).astype(np.int64)
    size = np.maximum(high - low + 1, 0)
    counts = size.prod(axis=1)
    near = np.flatnonzero(counts)
    batch = np.cumsum(counts[near]) // PAIRS_AT_ONCE
    none = np.empty(0, np.int64)
    found = [Crossings(none, none, none, none, np.empty((0, 3)))]
    for number in np.unique(batch):
        among = near[batch == number]
        triangle = np.repeat(among, counts[among])  # once for every column of its rectangle
        within = np.arange(len(triangle)) - np.repeat(np.cumsum(counts[among]) - counts[among], counts[among])
        column = low[triangle] + np.stack(np.divmod(within, size[triangle, 1]), axis=-1)
        found.append(_crossed(places[triangle], triangle, column, shape))
    return Crossings(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _crossed(corners: Doubles, triangle: Integers, column: Integers, shape: tuple[int, ...]) -> Crossings:
    """Pairs of a triangle, with its corners (k, 3, 3), and a column (k, 2) that cross."""
    areas, left = zip(*(_side(corners[:, k, :2], corners[:, (k + 1) % 3, :2], column) for k in range(3)), strict=True)
    total = areas[0] + areas[1] + areas[2]
    same = (left[0] == left[1]) & (left[1] == left[2]) & (total != 0)
    # the area beside an edge is the weight of the corner opposite to it
    weights = np.stack([areas[1], areas[2], areas[0]], axis=-1)[same] / total[same, None]
    heights = (weights * corners[same, :, 2]).sum(axis=1)
    return Crossings(
        column[same] @ np.array([shape[1], 1]),
        np.clip(np.ceil(heights), 0, shape[2]).astype(np.int64),
        np.where(left[0][same], 1, -1),
        triangle[same],
        weights,
    )


def _side(start: Doubles, end: Doubles, point: Integers) -> tuple[Doubles, Mask]:
    """Twice the area of edges (n, 2) with a point, and whether it is on their left.

    Two triangles that share an edge find the same, so that a column on it crosses one of them.
    """
    swapped = (start[:, 0] > end[:, 0]) | ((start[:, 0] == end[:, 0]) & (start[:, 1] > end[:, 1]))
    first = np.where(swapped[:, None], end, start)
    along, towards = np.where(swapped[:, None], start, end) - first, point - first
    area = along[:, 0] * towards[:, 1] - along[:, 1] * towards[:, 0]
    return np.where(swapped, -area, area), (area >= 0) ^ swapped
