"""Which voxels can hold smoke: those whose every calibrated picture shows smoke where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.scene import Camera, Domain
from smokelift.scene.projection import project


@dataclass(frozen=True, eq=False)
class Projection:
    """Where the voxels of a grid lie in a picture.

    Attributes
    ----------
    rows, columns : (nx, ny, nz) float32
        Picture coordinates of the voxel centres, pixel centres at integers.
    visible : (nx, ny, nz) bool
        Voxels before the camera whose centre falls into the picture.
    footprint : float
        Largest width of a voxel in the picture, in pixels.
    """

    rows: NDArray[np.float32]
    columns: NDArray[np.float32]
    visible: NDArray[np.bool_]
    footprint: float

    def read(self, picture: NDArray[np.float32], voxels: NDArray[np.bool_]) -> NDArray[np.float32]:
        """The picture (rows, columns) read bilinearly at some voxels (n,); the nearest pixel's value outside."""
        return read_bilinearly(picture, self.rows[voxels], self.columns[voxels])


def read_bilinearly(
    picture: NDArray[np.float32], rows: NDArray[np.float32], columns: NDArray[np.float32]
) -> NDArray[np.float32]:
    """A picture (rows, columns) at places (n,) in pixels; the nearest pixel's value outside."""
    return np.asarray(ndimage.map_coordinates(picture, (rows, columns), order=1, mode="nearest"), np.float32)


def voxel_centres(domain: Domain) -> NDArray[np.float64]:
    """World positions (nx, ny, nz, 3) of the voxel centres."""
    return np.stack(np.meshgrid(*_axes(domain), indexing="ij"), -1)


def centres_of(voxels: NDArray[np.bool_], domain: Domain) -> NDArray[np.float64]:
    """World positions (n, 3) of the centres of the marked voxels."""
    places = [axis[index] for axis, index in zip(_axes(domain), np.nonzero(voxels), strict=True)]
    return np.stack(places, -1)


def _axes(domain: Domain) -> list[NDArray[np.float64]]:
    """World coordinates of the voxel centres along x, y and z."""
    h = domain.voxel_size
    return [low + (np.arange(n) + 0.5) * h for low, n in zip(domain.min, domain.resolution, strict=True)]


@lru_cache(maxsize=8)
def project_voxels(camera: Camera, domain: Domain) -> Projection:
    """Project every voxel centre of a domain."""
    pixels, depth = project(camera, voxel_centres(domain))
    columns, rows = pixels[..., 0] - 0.5, pixels[..., 1] - 0.5
    width, height = camera.size
    inside = (columns > -0.5) & (columns < width - 0.5) & (rows > -0.5) & (rows < height - 0.5)
    near = np.min(depth[depth > 0], initial=np.inf) if camera.type == "perspective" else 1.0
    # the diagonal of a voxel is its largest width from any side
    footprint = max(camera.fx, camera.fy) * domain.voxel_size * np.sqrt(3) / near
    return Projection(rows.astype(np.float32), columns.astype(np.float32), inside & (depth > 0), float(footprint))


def reached(mask: NDArray[np.bool_], projection: Projection) -> NDArray[np.bool_]:
    """Pixels (rows, columns) that the voxels of the mask's hull can change."""
    return np.asarray(ndimage.binary_dilation(mask, iterations=2 * _radius(projection) + 1))


def _radius(projection: Projection) -> int:
    """Half a voxel's footprint in whole pixels."""
    return max(1, round(projection.footprint / 2))


def visual_hull(mask: NDArray[np.bool_], projection: Projection) -> NDArray[np.bool_]:
    """Voxels (nx, ny, nz) whose footprint meets the mask (rows, columns) of a picture's smoke pixels."""
    grown = ndimage.binary_dilation(mask, iterations=_radius(projection))
    height, width = mask.shape
    rows = np.clip(np.rint(projection.rows), 0, height - 1).astype(np.intp)
    columns = np.clip(np.rint(projection.columns), 0, width - 1).astype(np.intp)
    return np.asarray(grown[rows, columns] & projection.visible)


def common_hull(masks: Sequence[NDArray[np.bool_]], projections: Sequence[Projection]) -> NDArray[np.bool_]:
    """Voxels (nx, ny, nz) that a picture shows, and that every picture which shows them allows to hold smoke."""
    allowed = [visual_hull(mask, projection) for mask, projection in zip(masks, projections, strict=True)]
    seen = np.any([projection.visible for projection in projections], axis=0)
    for part, projection in zip(allowed, projections, strict=True):
        seen &= part | ~projection.visible
    return np.asarray(seen)


def agreement(masks: Sequence[NDArray[np.bool_]], projections: Sequence[Projection]) -> float:
    """Share of all pictures' smoke pixels behind which voxels lie that no picture rules out; 1 without any smoke.

    About 1 for true views of the same smoke; little for cameras that are not where they are said to be.
    """
    hull = common_hull(masks, projections)
    explained = shown = 0
    for mask, projection in zip(masks, projections, strict=True):
        voxels = hull & projection.visible
        covered = np.zeros(mask.shape, np.bool_)
        pixels = (np.rint(part[voxels]).astype(np.intp) for part in (projection.rows, projection.columns))
        covered[tuple(pixels)] = True
        covered = ndimage.binary_dilation(covered, iterations=2 * _radius(projection))
        explained += np.count_nonzero(mask & covered)
        shown += np.count_nonzero(mask)
    return explained / shown if shown else 1.0
