"""Light that a flame gives off in smoke: its integral along the rays of a camera.

    L = integral of T(s) e(s) ds,   T(s) the transmittance of the smoke before s,

on the samples of `smokelift.render.camera_rays`, where the renderer's are: a sample stands for a step of length d with
constant extinction kappa and emission e, which adds e (1 - exp(-kappa d)) / kappa to what reaches it. Emission is
linear in the picture, so that a matrix says all of it.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from smokelift.checks import Mask
from smokelift.render.camera_rays import camera_rays
from smokelift.render.renderer import Image, Optics, Volume
from smokelift.scene import Camera
from smokelift.scene.domain import LATERAL, box_around
from smokelift.scene.projection import project_points


def emitted(flame: Volume, density: Volume, camera: Camera, optics: Optics) -> Image:
    """The light of a flame as a camera that stands still sees it through smoke, radiance (rows, columns).

    What the smoke scatters of it is left out. The flame (nx, ny, nz), radiance per meter, is not negative; the optics
    give the domain, and the smoke's extinction.
    """
    width, height = camera.size
    picture = np.zeros(width * height)
    if flame.any():
        pixels = np.flatnonzero(_shows(flame, camera, optics))
        values = flame.ravel()
        for rays, voxels, weights in _samples(density, camera, optics, pixels):
            picture[pixels[rays]] += (weights * values[voxels]).sum(0)
    return picture.reshape(height, width).astype(np.float32)


def emission_matrix(density: Volume, camera: Camera, optics: Optics, pixels: Mask, voxels: Mask) -> sparse.csr_array:
    """The matrix, in meters, that turns the emission of some voxels into the light that some pixels get of it.

    Its rows are the marked pixels (rows, columns), its columns the marked voxels (nx, ny, nz), in the order of
    `numpy.flatnonzero`. Density, camera and optics are as in `emitted`.
    """
    shape = np.count_nonzero(pixels), np.count_nonzero(voxels)
    number = np.full(voxels.size, -1)
    number[voxels.ravel()] = np.arange(shape[1])
    values, rows, columns = [np.zeros(0)], [np.zeros(0, np.intp)], [np.zeros(0, np.intp)]
    for rays, corners, weights in _samples(density, camera, optics, np.flatnonzero(pixels)):
        there = (number[corners] >= 0) & (weights > 0)
        values.append(weights[there])
        rows.append(np.broadcast_to(rays, corners.shape)[there])
        columns.append(number[corners][there])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(entries, shape=shape)


def _samples(
    density: Volume, camera: Camera, optics: Optics, pixels: NDArray[np.intp]
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]]:
    """Which rays (n,) of the pixels cross a plane, the four voxels (4, n) about each place, and their weights (m).

    Plane by plane from the camera on.
    """
    rays, shape = camera_rays(camera, optics.domain), optics.domain.resolution
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    lines, planes = rays.lines.reshape(-1, 4)[pixels], rays.planes.reshape(-1, 4)[pixels]
    length = rays.length.ravel()[pixels]
    smoke, extinction = density.ravel(), optics.medium.extinction
    clear = np.ones(len(pixels))
    for axis in rays.axes:
        b_axis, c_axis = LATERAL[axis]
        for travel in (1, -1):
            along = np.flatnonzero((planes[:, 0] == axis) & (planes[:, 1] == travel))
            for k in range(shape[axis])[::travel]:
                here = along[(planes[along, 2] <= k) & (k <= planes[along, 3])]
                if not here.size:
                    continue
                b, c = (lines[here, n] + lines[here, n + 1] * k for n in (0, 2))
                voxels, weights = [], []
                for i, near_b in _neighbors(b, shape[b_axis]):
                    for j, near_c in _neighbors(c, shape[c_axis]):
                        voxels.append(k * strides[axis] + i * strides[b_axis] + j * strides[c_axis])
                        weights.append(near_b * near_c)
                places, weight = np.array(voxels), np.array(weights)
                depth = extinction * length[here] * (weight * smoke[places]).sum(0)
                step = clear[here] * length[here] * -np.expm1(-depth) / np.where(depth > 0, depth, 1)
                step = np.where(depth > 0, step, clear[here] * length[here])
                clear[here] *= np.exp(-depth)
                yield here, places, weight * step


def _neighbors(place: NDArray[np.float32], count: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float32]]]:
    """The two voxels of a row beside some places, and their linear weights: 0 outside the grid."""
    low = np.floor(place).astype(np.intp)
    for index, weight in ((low, 1 - (place - low)), (low + 1, place - low)):
        yield np.clip(index, 0, count - 1), np.where((index >= 0) & (index < count), weight, 0)


def _shows(flame: Volume, camera: Camera, optics: Optics) -> Mask:
    """Pixels (rows, columns) that may show a flame: those before the box of its voxels."""
    width, height = camera.size
    domain = optics.domain
    ends = [
        low + np.array((side.start - 0.5, side.stop + 0.5)) * domain.voxel_size
        for low, side in zip(domain.min, box_around(flame > 0, 0), strict=True)
    ]
    corners = np.stack(np.meshgrid(*ends, indexing="ij"), -1).reshape(-1, 3)
    seen, depth = project_points(camera, corners)
    if (depth <= 0).any():
        return np.ones((height, width), np.bool_)
    low, high = seen.min(0), seen.max(0)
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    across, up = (x > low[0]) & (x < high[0]), (y > low[1]) & (y < high[1])
    return np.asarray(up[:, None] & across)
