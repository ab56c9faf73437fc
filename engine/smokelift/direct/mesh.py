"""Obstacles of any shape: a surface of triangles, and the voxels that it encloses.

A voxel is enclosed if the surface winds around it. That is counted along the columns of voxels of each axis; a column
in which the crossings do not balance passes through a hole of the surface and says nothing, and the others decide by
majority. So parts may overlap, and a few holes do no harm (after Nooruddin and Turk 2003).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.direct.constraint import Mask
from smokelift.scene import Domain
from smokelift.scene.checks import LARGEST

Values = npt.NDArray[np.float64]

HEADER, RECORD = 84, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""Of a binary STL file: bytes before the triangles, the last four of them their number, and a triangle."""

PAIRS_AT_ONCE = 2**20
"""Pairs of a triangle and a column that are looked at together, which bounds the memory."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface of triangles as an obstacle.

    Attributes
    ----------
    triangles : (n, 3, 3)
        Corners in metres. Which way they turn does not matter, as long as it is the same over each part.
    """

    triangles: npt.NDArray[np.float32]

    @staticmethod
    def read(path: Path) -> Mesh:
        """Read a binary STL file, in metres, Z up.

        Raises
        ------
        ValueError
            With the path, if it cannot be read, is damaged or of another kind.
        """
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
            raise ValueError(
                f"{path}: is no binary STL file with triangles, or damaged; export the mesh as binary STL."
            )
        triangles = np.frombuffer(content, RECORD)["corners"]
        if not (np.abs(triangles) <= LARGEST).all():
            raise ValueError(f"{path}: has corners that are no numbers up to {LARGEST:g} m; export the mesh again.")
        return Mesh(triangles)

    def voxels(self, domain: Domain) -> Mask:
        """The voxels whose centres it encloses, shape (nx, ny, nz).

        Raises
        ------
        ValueError
            If it is open, such as a plane, so that it encloses nothing.
        """
        places = (self.triangles.astype(np.float64) - domain.min) / domain.voxel_size - 0.5
        votes, crossed = np.zeros(domain.shape, np.int8), False
        for axis in range(3):
            order = [(axis + 1) % 3, (axis + 2) % 3, axis]
            wound, open_columns = _wound(places[:, :, order], tuple(domain.shape[d] for d in order))
            crossed |= bool(open_columns.any())
            vote = np.where(open_columns[..., None], 0, np.where(wound, 1, -1)).astype(np.int8)
            votes += vote.transpose(np.argsort(order))
        enclosed: Mask = votes > 0
        if crossed and not enclosed.any():
            raise ValueError("the mesh of an obstacle is open and encloses nothing; close it, or give it a thickness.")
        return enclosed

    def told(self) -> dict[str, Any]:
        """What tells it from another, for the settings of a sequence."""
        content = np.ascontiguousarray(self.triangles, "<f4").tobytes()
        return {"triangles": len(self.triangles), "checksum": hashlib.sha256(content).hexdigest()}


def _wound(places: Values, shape: tuple[int, ...]) -> tuple[Mask, Mask]:
    """Around which voxels triangles wind, and in which columns along the last axis they are open.

    The triangles, (n, 3, 3), are in voxels from the centre of the first.
    """
    turns = np.zeros((shape[0] * shape[1], shape[2] + 1), np.int32)
    for column, height, sign in _crossings(places, shape):
        voxel = np.clip(np.ceil(height), 0, shape[2]).astype(np.int64)
        np.add.at(turns, (column, voxel), sign)
    wound: Mask = np.cumsum(turns[:, :-1], axis=1) != 0
    open_columns: Mask = turns.sum(axis=1) != 0
    return wound.reshape(shape), open_columns.reshape(shape[:2])


def _crossings(
    places: Values, shape: tuple[int, ...]
) -> Iterator[tuple[npt.NDArray[np.int64], Values, npt.NDArray[np.int32]]]:
    """Where columns cross triangles: the column, the height, and 1 or -1 for the side it comes from."""
    limit = np.array(shape[:2]) - 1
    low = np.clip(np.ceil(places[:, :, :2].min(axis=1)), 0, limit + 1).astype(np.int64)
    high = np.clip(np.floor(places[:, :, :2].max(axis=1)), -1, limit).astype(np.int64)
    size = np.maximum(high - low + 1, 0)
    counts = size.prod(axis=1)
    near = np.flatnonzero(counts)
    batch = np.cumsum(counts[near]) // PAIRS_AT_ONCE
    for number in np.unique(batch):
        some = near[batch == number]
        of = np.repeat(some, counts[some])
        within = np.arange(len(of)) - np.repeat(np.cumsum(counts[some]) - counts[some], counts[some])
        column = low[of] + np.stack([within // size[of, 1], within % size[of, 1]], axis=-1)
        corners = places[of]
        areas, left = zip(
            *(_side(corners[:, k, :2], corners[:, (k + 1) % 3, :2], column) for k in range(3)), strict=True
        )
        total = areas[0] + areas[1] + areas[2]
        same = (left[0] == left[1]) & (left[1] == left[2]) & (total != 0)
        # the area beside an edge is the weight of the corner opposite to it
        weighted = sum(area * corners[:, (k + 2) % 3, 2] for k, area in enumerate(areas))
        heights = np.asarray(weighted)[same] / total[same]
        yield column[same] @ np.array([shape[1], 1]), heights, np.where(left[0][same], 1, -1).astype(np.int32)


def _side(start: Values, end: Values, point: npt.NDArray[np.int64]) -> tuple[Values, Mask]:
    """Twice the area of edges (n, 2) with a point, and whether it is on their left.

    Two triangles that share an edge find the same, so that a column on it crosses one of them.
    """
    swapped = (start[:, 0] > end[:, 0]) | ((start[:, 0] == end[:, 0]) & (start[:, 1] > end[:, 1]))
    first = np.where(swapped[:, None], end, start)
    along, towards = np.where(swapped[:, None], start, end) - first, point - first
    area = along[:, 0] * towards[:, 1] - along[:, 1] * towards[:, 0]
    return np.where(swapped, -area, area), (area >= 0) ^ swapped
