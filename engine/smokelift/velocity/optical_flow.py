"""The motion that a camera's pictures show, in the velocity of smoke that it alone saw.

The velocity's grid is coarse, because the depth of the smoke is assumed. What moves across the picture is not: the clip
shows it pixel by pixel. So the velocity is corrected in the picture: with q its mean along each ray, in pixels a
frame, the correction d of every cell, about as wide as a voxel of the velocity, minimizes

    sum over pixels (r + g . d)^2 / mean |g|^2  +  sum over cells pixels (CURVATURE |laplacian d|^2 + REST |d|^2)

    r = after(x) - before(x - q(x)),     g = gradient of (after(x) + before(x - q(x))) / 2

where before and after are roots of optical depths, so that thin smoke counts too. It is given to all voxels of a ray
alike. Then the velocity is averaged along the line of sight. The depth and the profile of the smoke along a ray are
assumed, and the expected velocity, the mean over all that they may be, hardly changes along it
(docs/experiments/velocity-one-view.md).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage, sparse
from scipy.sparse.linalg import cg

from smokelift.checks import Array, Doubles
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import project_points
from smokelift.transport import Velocity, on_faces, without_divergence

CURVATURE, REST = 0.05, 0.14
"""Weights, for each pixel of a cell, of a correction's squared Laplacian from cell to cell and of its square
(docs/experiments/velocity-one-view.md)."""

TOLERANCE, MAX_STEPS = 1e-2, 50
"""Residual, relative to the start's, at which the solution is taken, and steps at most."""

OUTSIDE_WEIGHT = 1e-3
"""Fraction of the largest density that counts where there is none, so that rays beside the smoke have a mean too."""

SPREAD = 1 / 8
"""Standard deviation of the average, in shortest sides of the box, which is cut out around the smoke
(docs/experiments/velocity-one-view.md)."""

REACH = 2.5
"""Reach of the average, in standard deviations."""


@dataclass(frozen=True, eq=False)
class PicturePair:
    """Two pictures of smoke that one camera alone saw, standing still.

    `before` and `after` (rows, columns) are roots of optical depths, so that thin smoke counts; `domain` is the box
    that holds the smoke.
    """

    before: Array
    after: Array
    camera: Camera
    domain: Domain


def correct_by_optical_flow(velocity: Velocity, pictures: PicturePair, density: Array, dt: float) -> Velocity:
    """A velocity that moves the smoke in the picture as the camera saw it move, averaged along the line of sight.

    The density (nx, ny, nz) is that of the second picture, on the velocity's grid; `dt` seconds lie between both.
    """
    camera, domain = pictures.camera, pictures.domain
    middle = np.array(domain.centre)
    ray = np.array(camera.matrix)[:3, 2] if camera.type == "orthographic" else middle - camera.position
    if pictures.after.any() and pictures.before.any():
        image, scale = _ImageGrid.of(camera, domain, velocity.shape, velocity.voxel_size), dt / velocity.voxel_size
        motion = image.mean_motion(velocity.centres() * np.float32(scale), density)
        correction = image.lifted(_correction(image, motion, pictures)) / np.float32(scale)
        faces = zip(velocity.faces, on_faces(correction), strict=True)
        velocity = velocity.with_faces(component + added for component, added in faces)
    return averaged_along(velocity, ray)


def averaged_along(velocity: Velocity, line: ArrayLike) -> Velocity:
    """A velocity averaged along a line of sight, without divergence; what is known of it stays as it is.

    The line (3,) has any length and either direction.
    """
    kernel = _line(np.array(line) / np.linalg.norm(line), SPREAD * min(velocity.shape))
    # one kernel for all components keeps the divergence zero, but not at the sides of the box
    means = (ndimage.correlate(component, kernel, mode="nearest") for component in velocity.faces)
    return velocity.with_faces(without_divergence(velocity.with_faces(means))[0].faces)


def _line(direction: Doubles, deviation: float) -> Array:
    """A Gaussian of so many voxels on a line through the middle of a box: eight voxels share every point."""
    ends = int(np.ceil(REACH * deviation))
    along = np.arange(-ends, ends + 1)
    points, weights = along[:, None] * direction, np.exp(-0.5 * np.square(along / deviation))
    half = np.ceil(np.abs(ends * direction)).astype(int) + 1
    kernel = np.zeros(2 * half + 1)
    low = np.floor(points).astype(int)
    for corner in np.ndindex(2, 2, 2):
        corner_weights = np.prod(np.where(corner, points - low, 1 - (points - low)), axis=1)
        np.add.at(kernel, tuple((low + corner + half).T), weights * corner_weights)
    return np.asarray(kernel / kernel.sum(), np.float32)


def _correction(image: "_ImageGrid", motion: Doubles, pictures: PicturePair) -> Array:
    """What the motion (cells, 2) of the picture lacks, in columns and rows per frame."""
    before, after = pictures.before, pictures.after
    smoke = after.ravel() > 0
    columns, rows = (image.pixels @ motion).T.reshape(2, *after.shape)
    down, across = np.indices(after.shape)
    carried = ndimage.map_coordinates(before, (down - rows, across - columns), order=1, mode="nearest")
    mean = (carried + after) / 2  # correlated, since a picture may be a single row
    gradient = [ndimage.correlate1d(mean, (-0.5, 0, 0.5), axis, mode="nearest").ravel() for axis in (1, 0)]
    steepness = float(np.mean(sum(part[smoke] ** 2 for part in gradient)))
    if steepness == 0:
        return np.zeros(motion.shape, np.float32)
    steep = np.flatnonzero((gradient[0] != 0) | (gradient[1] != 0))  # the others say nothing
    pixels = image.pixels[steep]
    along = sparse.hstack([pixels.multiply(part[steep, None]) for part in gradient]).tocsr()
    normal = (along.T @ along / steepness + sparse.block_diag([image.penalty] * 2)).tocsr()
    right = along.T @ (carried - after).ravel()[steep] / steepness
    found, _ = cg(normal, right, rtol=TOLERANCE, maxiter=MAX_STEPS, M=sparse.diags(1 / normal.diagonal()))
    # sums may be taken in another order on another day, and a run has to be the same to the bit
    return np.asarray(found.reshape(2, -1).T, np.float32)


@dataclass(frozen=True, eq=False)
class _ImageGrid:
    """Cells of a picture, about as wide as voxels of a grid are in it."""

    shape: tuple[int, int, int]
    """Of the grid."""
    pixels: sparse.csr_matrix
    voxels: sparse.csr_matrix
    """Bilinear weights of the cells at every pixel and at every voxel's center."""
    moved: Doubles
    """(voxels, 2, 3): columns and rows that a voxel moves by in the picture for each voxel that it moves in the
    grid."""
    least: Doubles
    """(voxels, 3, 2): the least motion in the grid for each column and row."""
    penalty: sparse.csr_matrix
    """What a correction costs beside what it explains."""

    @staticmethod
    @lru_cache(maxsize=2)
    def of(camera: Camera, domain: Domain, shape: tuple[int, int, int], voxel_size: float) -> "_ImageGrid":
        """The cells for a grid from the domain's low corner on, its voxels so many meters wide."""
        centers = np.array(domain.min) + (np.indices(shape).reshape(3, -1).T + 0.5) * voxel_size
        at, _ = project_points(camera, centers)
        halves = 0.5 * voxel_size * np.eye(3)
        steps = [
            project_points(camera, centers + half)[0] - project_points(camera, centers - half)[0] for half in halves
        ]
        moved = np.stack(steps, -1)
        width, height = camera.size
        wide = float(np.median(np.linalg.norm(moved, axis=(1, 2)) / np.sqrt(2)))
        counts = max(round(height / wide), 2), max(round(width / wide), 2)
        rows, columns = np.indices((height, width)).reshape(2, -1) + 0.5
        sizes = height / counts[0], width / counts[1]
        pixels, voxels = (
            _bilinear(down / sizes[0] - 0.5, across / sizes[1] - 0.5, counts)
            for down, across in ((rows, columns), (at[:, 1], at[:, 0]))
        )
        laplacian = sparse.kronsum(*(_differences(count) for count in counts[::-1]))
        penalty = CURVATURE * laplacian @ laplacian + REST * sparse.identity(counts[0] * counts[1])
        penalty *= sizes[0] * sizes[1]
        return _ImageGrid(shape, pixels, voxels, moved, np.linalg.pinv(moved), penalty.tocsr())

    def mean_motion(self, motion: Array, density: Array) -> Doubles:
        """Mean along the rays (cells, 2), in columns and rows per frame, of a motion (nx, ny, nz, 3) in voxels."""
        weight = density.ravel() + OUTSIDE_WEIGHT * float(density.max()) + np.finfo(np.float32).tiny
        across = np.einsum("nij,nj->ni", self.moved, motion.reshape(-1, 3))
        sums = self.voxels.T @ np.column_stack([weight[:, None] * across, weight])
        return np.asarray(sums[:, :2] / np.maximum(sums[:, 2:], np.finfo(np.float64).tiny))

    def lifted(self, motion: Array) -> Array:
        """The least motion (nx, ny, nz, 3) in voxels that looks like one of the picture, (cells, 2)."""
        seen = self.voxels @ motion
        return np.asarray(np.einsum("nij,nj->ni", self.least, seen).reshape(*self.shape, 3), np.float32)


def _bilinear(rows: Doubles, columns: Doubles, counts: tuple[int, int]) -> sparse.csr_matrix:
    """Weights (points, cells) that interpolate between cells; beyond the last it goes on as there."""
    low, weights = [], []
    for places, count in ((rows, counts[0]), (columns, counts[1])):
        places = np.clip(places, 0, count - 1)
        low.append(np.minimum(places.astype(np.intp), count - 2))
        weights.append(places - low[-1])
    points = np.arange(len(rows))
    parts = [
        ((abs(1 - i - weights[0]) * abs(1 - j - weights[1])), (low[0] + i) * counts[1] + low[1] + j)
        for i in (0, 1)
        for j in (0, 1)
    ]
    values, cells = (np.concatenate(part) for part in zip(*parts, strict=True))
    return sparse.csr_matrix((values, (np.tile(points, 4), cells)), (len(rows), counts[0] * counts[1]))


def _differences(count: int) -> sparse.csr_matrix:
    """Squared first differences of a row of cells, as a matrix."""
    first = sparse.diags([-np.ones(count - 1), np.ones(count - 1)], [0, 1], shape=(count - 1, count))
    return (first.T @ first).tocsr()
