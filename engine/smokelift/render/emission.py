"""Light that a flame gives off in smoke: its integral along the rays of a camera.

    L = integral of T(s) e(s) ds,   T(s) the transmittance of the smoke before s,

on the samples of `smokelift.render.plan`, where the renderer's are: a sample stands for a step of length d with
constant extinction kappa and emission e, which adds e (1 - exp(-kappa d)) / kappa to what reaches it. Emission is
linear in the picture, so that a matrix says all of it.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from scipy import ndimage, sparse

from smokelift.checks import Doubles, Indices, Mask
from smokelift.render.image import LARGEST_DEPTH
from smokelift.render.plan import BAND, camera_rays
from smokelift.render.renderer import Image, Optics, Volume
from smokelift.scene import Camera
from smokelift.scene.domain import LATERAL, box_around


def emitted(flame: Volume, density: Volume, camera: Camera, optics: Optics) -> Image:
    """The light of a flame as a camera that stands still sees it through smoke, radiance (rows, columns).

    What the smoke scatters of it is left out. The flame (nx, ny, nz), radiance per meter, is not negative; the optics
    give the domain, and the smoke's extinction.
    """
    width, height = camera.size
    picture = np.zeros(width * height)
    if flame.any():
        values = np.pad(flame, 1).ravel()
        pixels = np.flatnonzero(_shows(flame, camera, optics))
        for seen, voxels, weights in _samples(density, camera, optics, pixels, flame > 0):
            picture[pixels[seen]] += (weights * values[voxels]).sum(0)
    return picture.reshape(height, width).astype(np.float32)


def emission_matrix(density: Volume, camera: Camera, optics: Optics, pixels: Mask, voxels: Mask) -> sparse.csr_array:
    """The matrix, in meters, that turns the emission of some voxels into the light that some pixels get of it.

    Its rows are the marked pixels (rows, columns), its columns the marked voxels (nx, ny, nz), in the order of
    `numpy.flatnonzero`. Density, camera and optics are as in `emitted`.
    """
    shape = np.count_nonzero(pixels), np.count_nonzero(voxels)
    numbers = np.full(voxels.shape, -1)
    numbers[voxels] = np.arange(shape[1])
    number = np.pad(numbers, 1, constant_values=-1).ravel()
    values, rows, columns = [np.zeros(0)], [np.zeros(0, np.intp)], [np.zeros(0, np.intp)]
    for seen, corners, weights in _samples(density, camera, optics, np.flatnonzero(pixels), voxels):
        there = (number[corners] >= 0) & (weights > 0)
        values.append(weights[there])
        rows.append(np.broadcast_to(seen, corners.shape)[there])
        columns.append(number[corners][there])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(entries, shape=shape)


def _samples(
    density: Volume, camera: Camera, optics: Optics, pixels: Indices, burning: Mask
) -> Iterator[tuple[Indices, Indices, Doubles]]:
    """Which of the pixels (n,) have a ray that crosses a plane, the four voxels (4, n) around, and their weights (m).

    Plane by plane from the camera on, as far as voxels (nx, ny, nz) burn. Voxels are numbers in a volume with a border
    of one.
    """
    rays, box = camera_rays(camera, optics.domain), box_around(burning, 0)
    padded = np.ascontiguousarray(np.pad(density, 1))
    strides, smoke = np.array(padded.strides) // padded.itemsize, padded.ravel()
    for part in np.array_split(np.arange(len(pixels)), len(pixels) // BAND + 1):
        of_part = pixels[part]
        lines, planes = rays.lines.reshape(-1, 4)[of_part], rays.planes.reshape(-1, 4)[of_part]
        length, clear = rays.length.ravel()[of_part], np.ones(len(part))
        for axis, travel in product(rays.axes, (1, -1)):
            along = np.flatnonzero((planes[:, 0] == axis) & (planes[:, 1] == travel))
            b_stride, c_stride = strides[list(LATERAL[axis])]
            corners = np.array([[0], [c_stride], [b_stride], [b_stride + c_stride]])
            whole = range(burning.shape[axis])
            for k in whole[: box[axis].stop] if travel > 0 else whole[box[axis].start :][::-1]:
                here = along[(planes[along, 2] <= k) & (k <= planes[along, 3])]
                if not here.size:
                    continue
                b, c = (lines[here, n] + lines[here, n + 1] * k for n in (0, 2))
                i, j = np.floor(b).astype(np.intp), np.floor(c).astype(np.intp)
                f, g = b - i, c - j
                voxels = (k + 1) * strides[axis] + (i + 1) * b_stride + (j + 1) * c_stride + corners
                weight = np.stack([(1 - f) * (1 - g), (1 - f) * g, f * (1 - g), f * g])
                depth = optics.medium.extinction * length[here] * (weight * smoke[voxels]).sum(0)
                step = clear[here] * length[here] * -np.expm1(-depth) / np.where(depth > 0, depth, 1)
                step = np.where(depth > 0, step, clear[here] * length[here])
                clear[here] *= np.exp(-depth)
                yield part[here], voxels, weight * step


def _shows(flame: Volume, camera: Camera, optics: Optics) -> Mask:
    """Pixels (rows, columns) that may show a flame: those that it would hide if it were opaque, and their neighbors."""
    renderer = replace(optics, scattering="absorption").renderer(camera, np.zeros(3, np.float32))
    opaque = np.float32(LARGEST_DEPTH / (optics.medium.extinction * optics.domain.voxel_size))
    renderer.image(np.where(flame > 0, opaque, np.float32(0)))
    return np.asarray(ndimage.binary_dilation(renderer.transmittance < 1))
