"""A mesh that moves or bends, frame by frame, and how fast its surface does."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from smokelift.checks.array_types import Mask
from smokelift.direct.mesh import ORDERS, Crossings, Mesh, enclosed
from smokelift.scene import Domain
from smokelift.scene.checks import Vector
from smokelift.transport import Array, Faces


@dataclass(frozen=True, eq=False)
class MovingMesh:
    """A mesh that is an obstacle, at one place after another.

    Attributes
    ----------
    places
        At the frame that the smoke starts from and at every frame after it, with the same triangles in the same order.
        It stays at the last one.

    Raises
    ------
    ValueError
        If there are none, or their numbers of triangles differ.
    """

    places: tuple[Mesh, ...]

    def __post_init__(self) -> None:
        counts = {len(place.triangles) for place in self.places}
        if len(counts) != 1:
            raise ValueError(
                f"a mesh that moves has {min(counts, default=0)} to {max(counts, default=0)} triangles, but has to "
                "keep their number; leave out what changes it, or export it at one moment."
            )

    @staticmethod
    def read(path: Path) -> MovingMesh:
        """Read numbered binary STL files from a pattern ``crate_####.stl`` (each # a digit at least).

        Raises
        ------
        ValueError
            If there are none or one is missing or damaged, or their numbers of triangles differ.
        """
        named = re.fullmatch(r"([^#]*)(#+)([^#]*)", path.name)
        if named is None or not path.parent.is_dir():
            raise ValueError(f"{path}: is no file, and no pattern crate_####.stl of numbered files; give one of them.")
        prefix, hashes, suffix = named.groups()
        pattern = re.compile(re.escape(prefix) + rf"(\d{{{len(hashes)},}})" + re.escape(suffix))
        matches = ((pattern.fullmatch(file.name), file) for file in path.parent.iterdir())
        found = {int(match[1]): file for match, file in matches if match}
        if not found:
            raise ValueError(f"{path}: there are no such files; number them as the frames are.")
        numbers = range(min(found), max(found) + 1)
        return MovingMesh(
            tuple(Mesh.read(found.get(n, path.with_name(f"{prefix}{n:0{len(hashes)}d}{suffix}"))) for n in numbers)
        )

    def at(self, step: int) -> Mesh:
        """The mesh so many frames after the one that the smoke starts from."""
        return self.places[min(step, len(self.places) - 1)]

    def bounds(self) -> tuple[Vector, Vector]:
        """The corners in meters of the box around all its places."""
        lows, highs = zip(*(place.bounds() for place in self.places), strict=True)
        (a, b, c), (d, e, f) = np.min(lows, axis=0).tolist(), np.max(highs, axis=0).tolist()
        return (a, b, c), (d, e, f)

    def solid(self, domain: Domain, step: int, dt: float) -> tuple[Mask, Faces]:
        """The voxels that it encloses after a step, and how fast it has moved there in m/s, on all faces.

        On a face between a voxel inside and one outside, the speed is that of the surface where it crosses the line
        between their centers; on others it is that of the nearest such face. A mesh that is open is refused by a
        ValueError.
        """
        before, now = self.at(step - 1).triangles, self.at(step).triangles
        speeds = (now.astype(np.float64) - before) / dt
        crossings = self.at(step).crossings(domain)
        x, y, z = (_on_faces(found, speeds[:, :, axis], domain, axis) for axis, found in enumerate(crossings))
        return enclosed(crossings, domain), (x, y, z)

    def fingerprint(self) -> dict[str, Any]:
        """Numbers of frames and triangles, and checksum, for the settings of a sequence."""
        parts = [place.fingerprint() for place in self.places]
        whole = hashlib.sha256("".join(part["checksum"] for part in parts).encode()).hexdigest()
        return {"frames": len(parts), "triangles": parts[0]["triangles"], "checksum": whole}


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
