"""Which voxels can hold smoke: those where every calibrated picture shows smoke."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Array, Mask
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import world_to_pixel


@dataclass(frozen=True, eq=False)
class Places:
    """Where some voxels lie in a picture.

    `rows` and `columns` (n,) are picture coordinates of their centers; pixel centers are integers. `visible` (n,) says
    whether they are before the camera and their center falls into the picture.
    """

    rows: Array
    columns: Array
    visible: Mask

    def read(self, picture: NDArray[np.floating[Any]]) -> Array:
        """The picture (rows, columns) read bilinearly there (n,); the nearest pixel's value outside."""
        return _core.read_bilinearly(picture, self.rows, self.columns)


@dataclass(frozen=True, eq=False)
class Projection:
    """Where the voxels of a grid lie in a picture, computed for the voxels that are asked for.

    `footprint` is the largest width of a voxel in the picture, in pixels, and `map` the compiled projection.
    """

    footprint: float
    map: _core.PictureMap
    _size: tuple[int, int]

    @cached_property
    def visible(self) -> Mask:
        """Voxels (nx, ny, nz) before the camera whose center falls into the picture."""
        return self.shown(np.ones(self._size[::-1], np.bool_))

    def places(self, voxels: Mask) -> Places:
        """Where the marked voxels lie, in the order of `numpy.flatnonzero`."""
        return Places(*self.map.places(voxels))

    def shown(self, marked: Mask) -> Mask:
        """Visible voxels (nx, ny, nz) whose nearest pixel is marked (rows, columns)."""
        return self.map.shown(marked)


@lru_cache(maxsize=8)
def project_voxels(camera: Camera, domain: Domain) -> Projection:
    """Project every voxel center of a domain."""
    x, y, z = domain.offsets((0, 0, 0))
    to_pixel = world_to_pixel(camera)
    projected = _core.PictureMap(to_pixel, [axis.ravel() for axis in (x, y, z)], camera.size)
    near = 1.0
    if camera.type == "perspective":
        for each in ((x[[0, -1]], y[:, [0, -1]], z[..., [0, -1]]), (x, y, z)):
            depth = sum(axis * along for axis, along in zip(each, to_pixel[2, :3], strict=True)) + to_pixel[2, 3]
            near = np.min(depth, where=depth > 0, initial=np.inf)
            if np.min(depth) > 0:  # at the corners, so everywhere
                break
    # the diagonal of a voxel is its largest width from any side
    footprint = max(camera.fx, camera.fy) * domain.voxel_size * np.sqrt(3) / near
    return Projection(float(footprint), projected, camera.size)


def reached(mask: Mask, projection: Projection) -> Mask:
    """Pixels (rows, columns) that the voxels of the mask's hull can change."""
    return np.asarray(ndimage.binary_dilation(mask, iterations=2 * _radius(projection) + 1))


def _radius(projection: Projection) -> int:
    """Half a voxel's footprint in whole pixels."""
    return max(1, round(projection.footprint / 2))


def visual_hull(mask: Mask, projection: Projection) -> Mask:
    """Voxels (nx, ny, nz) whose footprint touches the mask (rows, columns) of a picture's smoke pixels."""
    grown = ndimage.binary_dilation(mask, iterations=_radius(projection))
    return projection.shown(grown)


def common_hull(masks: Sequence[Mask], projections: Sequence[Projection]) -> Mask:
    """Voxels (nx, ny, nz) that a picture shows, and that every picture which shows them allows to hold smoke."""
    allowed = [visual_hull(mask, projection) for mask, projection in zip(masks, projections, strict=True)]
    if len(allowed) == 1:
        return allowed[0]
    seen = np.any([projection.visible for projection in projections], axis=0)
    for part, projection in zip(allowed, projections, strict=True):
        seen &= part | ~projection.visible
    return np.asarray(seen)


def agreement(masks: Sequence[Mask], projections: Sequence[Projection]) -> float:
    """Fraction of all pictures' smoke pixels behind which voxels lie that no picture rules out; 1 without any smoke.

    It is about 1 for true views of the same smoke, and small for cameras that are not where they are said to be.
    """
    hull = common_hull(masks, projections)
    explained = shown = 0
    for mask, projection in zip(masks, projections, strict=True):
        places = projection.places(hull & projection.visible)
        covered = np.zeros(mask.shape, np.bool_)
        covered[np.rint(places.rows).astype(np.intp), np.rint(places.columns).astype(np.intp)] = True
        covered = ndimage.binary_dilation(covered, iterations=2 * _radius(projection))
        explained += np.count_nonzero(mask & covered)
        shown += np.count_nonzero(mask)
    return explained / shown if shown else 1.0
