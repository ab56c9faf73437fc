"""How far a camera has turned between two pictures, measured on what stands still.

A camera that turns about its centre maps one picture to the other by K R K^-1, whatever the distance of what it shows:
three numbers for a whole picture. They are fitted to the picture itself (Lucas and Kanade, "An iterative image
registration technique", 1981; inverse compositional: Baker and Matthews, "Lucas-Kanade 20 years on", 2004), from coarse
to fine, with a redescending weight that leaves out what moves by itself: smoke, people, leaves (Tukey's biweight).

The pictures are band-passed and brought to one contrast everywhere, so that neither exposure nor soft smoke counts and
smoke of strong contrast counts no more than a faint wall. They are compared at the steepest points of every cell of a
grid, so that no corner of the picture is decided by another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage
from scipy.spatial.transform import Rotation

from smokelift.footage.images import Picture, area_average, blurred, channel_mean, linear_to_srgb

Array = NDArray[np.float64]

LONGEST = 512
"""Pixels along the longer side of the finest picture that is compared."""

LEVELS = 4
"""Pictures from coarse to fine, each twice the one before: motion of 20 pixels of the finest is within reach."""

FINE, COARSE = 0.8, 3.0
"""Standard deviations (pixels of a level) of the two Gaussians whose difference is compared."""

AROUND = 6.0
"""Standard deviation (pixels of a level) of the Gaussian over which the contrast around a pixel is measured."""

FAINT = 3 / 255
"""Contrast, in sRGB values, below which there is more noise than texture."""

CELLS = 12
"""Cells along the picture's longer side."""

POINTS = 64
"""Points of a cell, those with the steepest slopes."""

ITERATIONS = 12
"""Steps on a level at most."""

CONVERGED = 0.003
"""Pixels of a step that is the last."""

TUKEY = 4.685
"""Standard deviations from which on a residual counts nothing (95 % efficiency on normal ones)."""

DEVIATION = 1.4826
"""Standard deviation of normal values in units of the median of their magnitudes."""

MIN_SPREAD = 0.01
"""Spread of the residuals below which two pictures are the same."""

SAME = 0.8
"""Correlation of a cell in two pictures from which on it shows the same in both."""

TEXTURE = 0.7
"""Standard deviation of a cell's points, in units of its contrast and `FAINT` together, from which on the contrast is
the greater."""

MIN_CELLS = 8
"""Cells with texture that can tell a turn, at least: a tenth of those of a picture full of it."""


@dataclass(frozen=True)
class Lens:
    """What turns pixels into directions: x right, y down, z forward.

    Attributes
    ----------
    size
        Width and height in pixels.
    focal
        Focal lengths in pixels, across and down.
    centre
        Where the optical axis meets the picture, in pixels.
    """

    size: tuple[int, int]
    focal: tuple[float, float]
    centre: tuple[float, float]

    def rays(self, pixels: Array) -> Array:
        """Directions (n, 3), with z = 1, of places (n, 2) in the picture."""
        return np.column_stack([(pixels - self.centre) / self.focal, np.ones(len(pixels))])

    def pixels(self, rays: Array) -> Array:
        """Places (n, 2) of directions (n, 3) in the picture; far outside it if they point back."""
        ahead = np.maximum(rays[:, 2:], 1e-6)
        return np.asarray(rays[:, :2] / ahead * self.focal + self.centre)

    def matrix(self) -> Array:
        """Matrix (3, 3) from directions (3,) to homogeneous places in the picture."""
        (across, down), (x, y) = self.focal, self.centre
        return np.array([[across, 0, x], [0, down, y], [0, 0, 1.0]])

    def resized(self, width: int, height: int) -> Lens:
        """The lens of the same picture with another number of pixels."""
        scale = width / self.size[0], height / self.size[1]
        focal, centre = ((pair[0] * scale[0], pair[1] * scale[1]) for pair in (self.focal, self.centre))
        return Lens((width, height), focal, centre)


@dataclass(frozen=True, eq=False)
class Level:
    """A picture at one resolution.

    Attributes
    ----------
    lens
        Of it.
    detail : (rows, columns)
        Band-passed, in units of the contrast around it.
    """

    lens: Lens
    detail: Picture

    def at(self, places: Array) -> tuple[Array, NDArray[np.bool_]]:
        """The values at places (n, 2) across and down, and which of them are inside the picture."""
        x, y = places.T
        rows, columns = self.detail.shape
        inside = (x > 1) & (x < columns - 1) & (y > 1) & (y < rows - 1)
        values = ndimage.map_coordinates(self.detail, [y - 0.5, x - 0.5], order=1, mode="nearest")
        return values.astype(np.float64), inside


def levels(picture: Picture, lens: Lens, count: int = LEVELS) -> tuple[Level, ...]:
    """Return a linear picture (rows, columns, 3) at all resolutions or the finest of them, the coarsest first."""
    found = []
    for coarsenings in range(count):
        columns, rows = level_size(lens, coarsenings)
        picture = area_average(picture, columns, rows)
        grey = channel_mean(linear_to_srgb(picture))
        detail = blurred(grey, FINE) - blurred(grey, COARSE)
        contrast = np.sqrt(blurred(detail**2, AROUND) + FAINT**2)
        found.append(Level(lens.resized(columns, rows), (detail / contrast).astype(np.float32)))
    return tuple(found[::-1])


def level_size(lens: Lens, coarsenings: int = 0) -> tuple[int, int]:
    """Return width and height of a picture of a lens at its finest resolution, or coarsened by two so many times."""
    scale = max(1.0, max(lens.size) / LONGEST) * 2**coarsenings
    columns, rows = (max(8, round(n / scale)) for n in lens.size)
    return columns, rows


@dataclass(frozen=True, eq=False)
class Points:
    """The points of a picture that others are compared with, on one level.

    Attributes
    ----------
    lens
        Of the level.
    rays : (n, 3)
        Directions.
    values : (n,)
        Of the band-passed picture.
    gradient : (n, 2)
        Change of the value by a pixel across and down.
    slopes : (n, 3)
        Change of the value by a turn about x, y and z (per radian).
    cells : (n,)
        Number of each one's cell.
    """

    lens: Lens
    rays: Array
    values: Array
    gradient: Array
    slopes: Array
    cells: NDArray[np.intp]

    @staticmethod
    def of(level: Level) -> Points:
        """Choose the points of a picture."""
        rows, columns = level.detail.shape
        down, across = np.gradient(level.detail)
        steep = np.hypot(down, across)
        steep[:2], steep[-2:], steep[:, :2], steep[:, -2:] = 0, 0, 0, 0
        side = max(rows, columns) / CELLS
        row, column = np.indices(level.detail.shape)
        cell = (row / side).astype(int) * CELLS + (column / side).astype(int)
        # the steepest of each cell: sorted by cell, then by slope
        order = np.lexsort((-steep.ravel(), cell.ravel()))
        ordered = cell.ravel()[order]
        rank = np.arange(len(order)) - np.searchsorted(ordered, ordered)
        most = max(4, min(POINTS, int(side**2 / 4)))
        chosen = order[(rank < most) & (steep.ravel()[order] > 0)]
        y, x = np.divmod(chosen, columns)
        rays = level.lens.rays(np.column_stack([x + 0.5, y + 0.5]))
        gradient = np.column_stack([across.ravel()[chosen], down.ravel()[chosen]]).astype(np.float64)
        # a ray (a, b, 1) that turns by w moves by w x ray, and its place on the plane z = 1 by that less its drift
        a, b = rays[:, 0], rays[:, 1]
        turn_x = np.column_stack([-a * b, -1 - b**2])
        turn_y = np.column_stack([1 + a**2, a * b])
        turn_z = np.column_stack([-b, a])
        slopes = np.column_stack([(gradient * level.lens.focal * turn).sum(1) for turn in (turn_x, turn_y, turn_z)])
        values = level.detail.ravel()[chosen].astype(np.float64)
        return Points(level.lens, rays, values, gradient, slopes, cell.ravel()[chosen])

    def seen_in(self, level: Level, turn: Rotation) -> tuple[Array, NDArray[np.bool_]]:
        """The values at the points in another picture, and which are inside it.

        ``turn`` turns directions of this picture into those of the other.
        """
        return level.at(self.lens.pixels(turn.apply(self.rays)))


def points_of(pictures: Sequence[Level]) -> tuple[Points, ...]:
    """Return the points of a picture on all its levels."""
    return tuple(Points.of(level) for level in pictures)


@dataclass(frozen=True, eq=False)
class Alignment:
    """How one picture lies on another.

    Attributes
    ----------
    turn
        Of directions of the first into those of the second.
    same
        Share of the cells with texture that show the same in both; 0 where there are too few to tell.
    shared
        Share of the first picture's points that are in the second.
    """

    turn: Rotation
    same: float
    shared: float


def align(first: Sequence[Points], second: Sequence[Level], start: Rotation) -> Alignment:
    """Find how a camera turned from one picture to another.

    Parameters
    ----------
    first, second
        Both from coarse to fine.
    start
        The turn from which the search begins.
    """
    turn = start
    for points, level in zip(first, second, strict=True):
        for _ in range(ITERATIONS):
            residual, weight = _residual(points, level, turn)
            weighted = points.slopes * weight[:, None]
            step = np.linalg.lstsq(weighted.T @ points.slopes, weighted.T @ residual, rcond=None)[0]
            turn = turn * Rotation.from_rotvec(-step)
            if np.abs(step).max() * max(level.lens.focal) < CONVERGED:
                break
    return judged(first[-1], second[-1], turn)


def shift(first: Sequence[Level], second: Sequence[Level]) -> Rotation:
    """Return about how a camera turned from one picture to another, by phase correlation on the second finest level.

    It finds any motion, whatever else moves, but no roll (Kuglin and Hines, "The phase correlation image alignment
    method", 1975).
    """
    here, there = (pictures[-2].detail for pictures in (first, second))
    shape = [fft.next_fast_len(2 * n, real=True) for n in here.shape]
    spectrum = np.conj(fft.rfft2(here, shape)) * fft.rfft2(there, shape)
    peaks = fft.irfft2(spectrum / np.maximum(np.abs(spectrum), np.finfo(np.float32).tiny), shape)
    peak = np.array(np.unravel_index(peaks.argmax(), peaks.shape))
    down, across = np.where(peak > np.array(shape) // 2, peak - shape, peak)
    focal_x, focal_y = first[-2].lens.focal
    return Rotation.from_rotvec([-np.arctan2(down, focal_y), np.arctan2(across, focal_x), 0.0])


def judged(points: Points, level: Level, turn: Rotation) -> Alignment:
    """Return how well two pictures lie on one another with a certain turn between them."""
    values, inside = points.seen_in(level, turn)
    if not inside.any():
        return Alignment(turn, 0.0, 0.0)
    correlation = cell_correlations(points, values, inside)
    correlation = correlation[np.isfinite(correlation)]
    same = float((correlation >= SAME).mean()) if len(correlation) >= MIN_CELLS else 0.0
    return Alignment(turn, same, float(inside.mean()))


def _residual(points: Points, level: Level, turn: Rotation) -> tuple[Array, Array]:
    """What differs at each point, and what it counts: nothing outside the second picture."""
    values, inside = points.seen_in(level, turn)
    residual = np.where(inside, values - points.values, 0.0)
    return residual, robust_weights(residual, inside)


def robust_weights(residual: Array, inside: NDArray[np.bool_]) -> Array:
    """Return what each residual counts: nothing outside the second picture, and nothing of what moves by itself."""
    spread = max(DEVIATION * float(np.median(np.abs(residual[inside]))), MIN_SPREAD) if inside.any() else 1.0
    return np.where(inside, np.maximum(1 - (residual / (TUKEY * spread)) ** 2, 0) ** 2, 0.0)


def cell_correlations(points: Points, values: Array, inside: NDArray[np.bool_]) -> Array:
    """Return how alike each cell is in two pictures.

    Parameters
    ----------
    points
        Of the first picture.
    values, inside : (n,)
        What the second shows at the points, and which of them are inside it.

    Returns
    -------
    (cells,)
        Correlation; not a number for a cell that has not the texture to say anything.
    """
    cells, here, there = points.cells[inside], points.values[inside], values[inside]

    def mean(of: Array) -> Array:
        return np.asarray(np.bincount(cells, of, CELLS**2) / np.maximum(number, 1))

    number = np.bincount(cells, minlength=CELLS**2)
    mean_here, mean_there = mean(here), mean(there)
    variance_here = mean(here**2) - mean_here**2
    variance_there = mean(there**2) - mean_there**2
    shared = mean(here * there) - mean_here * mean_there
    correlation = shared / np.sqrt(np.maximum(variance_here * variance_there, np.finfo(float).tiny))
    return np.where((number >= POINTS // 2) & (variance_here > TEXTURE**2), correlation, np.nan)
