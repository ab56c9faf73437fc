"""The benchmark's samples as flat tables, so that no peer spends its time on geometry.

A volume is padded by one voxel on every side (kappa with zero, J with the nearest voxel's value) and flattened. A
sample is then a cell, the index of its lowest corner, and two weights; the other corners are ``across`` and ``down``
further on. Rays that miss the grid are left out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.renderer.scene import BenchScene
from smokelift.checks import Array
from smokelift.render.plan import camera_rays
from smokelift.scene.domain import LATERAL

Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class RayTable:
    """The rays that meet the grid, each (rays,); sample s of a ray lies at b + s db, c + s dc of plane first + s next.

    Attributes
    ----------
    pixel
        Flat number of the pixel.
    count
        Number of samples.
    step
        Distance between them, m.
    b, db, c, dc
        Position in the plane and its change, in voxels of the padded grid.
    first, next
        Flat index of the padded plane's corner, and its change.
    across, down
        Strides of b and c in the padded, flattened grid.
    axis
        Dominant axis.
    plane, travel
        Number of the first plane in the grid that is not padded, and +1 or -1, its change.
    """

    pixel: Ints
    count: Ints
    step: Array
    b: Array
    db: Array
    c: Array
    dc: Array
    first: Ints
    next: Ints
    across: Ints
    down: Ints
    axis: Ints
    plane: Ints
    travel: Ints


def ray_table(scene: BenchScene) -> RayTable:
    """Return the rays of a scene."""
    rays = camera_rays(scene.camera, scene.domain)
    planes = rays.planes.reshape(-1, 4)
    pixel = np.nonzero(planes[:, 2] <= planes[:, 3])[0]
    axis, travel, low, high = planes[pixel].T
    plane = np.where(travel > 0, low, high)
    b, db, c, dc = rays.lines.reshape(-1, 4)[pixel].astype(np.float64).T
    _, ny, nz = (n + 2 for n in scene.domain.resolution)
    stride = np.array([ny * nz, nz, 1])
    lateral = np.array(LATERAL)[axis]
    return RayTable(
        pixel=pixel.astype(np.int32),
        count=(high - low + 1).astype(np.int32),
        step=rays.length.reshape(-1)[pixel],
        b=(b + db * plane + 1).astype(np.float32),
        db=(db * travel).astype(np.float32),
        c=(c + dc * plane + 1).astype(np.float32),
        dc=(dc * travel).astype(np.float32),
        first=((plane + 1) * stride[axis]).astype(np.int32),
        next=(travel * stride[axis]).astype(np.int32),
        across=stride[lateral[:, 0]].astype(np.int32),
        down=stride[lateral[:, 1]].astype(np.int32),
        axis=axis.astype(np.int32),
        plane=plane.astype(np.int32),
        travel=travel.astype(np.int32),
    )


@dataclass(frozen=True, eq=False)
class LightTable:
    """The light's columns: depth = S^T K S kappa, plane after plane along ``axis`` in the order of ``planes``.

    Plane k, with its two lateral axes in ascending order, has one slot more than voxels along each. Its slot (i, j)
    is column (i, j) + window[k] of ``columns`` and lies between voxels i - 1 and i.

    Attributes
    ----------
    axis
        Dominant axis of the light.
    planes
        Plane numbers in the order in which the light meets them.
    window : (n, 2) int
        Where the slots of a plane begin among the columns.
    weight : (n, 2) float32
        f and g: a slot is (1 - f) of voxel i - 1 and f of voxel i; a voxel i is f of slot i and 1 - f of slot i + 1.
    columns
        Number of columns along the two lateral axes.
    step
        Length of the light's ray between two planes, m.
    """

    axis: int
    planes: range
    window: Ints
    weight: Array
    columns: tuple[int, int]
    step: float


def light_table(scene: BenchScene) -> LightTable:
    """Return the columns of a scene's light."""
    direction = np.array(scene.light.direction)
    axis = int(np.argmax(np.abs(direction)))
    n = scene.domain.resolution[axis]
    slope = direction[list(LATERAL[axis])] / direction[axis]
    shift = np.floor(np.arange(n)[:, None] * slope)
    window = (shift.max(0) - shift).astype(np.int32)
    rows, columns = (
        scene.domain.resolution[b] + 1 + int(most) for b, most in zip(LATERAL[axis], window.max(0), strict=True)
    )
    return LightTable(
        axis=axis,
        planes=range(n) if direction[axis] > 0 else range(n - 1, -1, -1),
        window=window,
        weight=(np.arange(n)[:, None] * slope - shift).astype(np.float32),
        columns=(rows, columns),
        step=scene.domain.voxel_size / abs(float(direction[axis])),
    )
