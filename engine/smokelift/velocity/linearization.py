"""The change between two densities as a linear function of the velocity, and the quadratic problem that it poses."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

import smokelift._core as _core
from smokelift.transport import Array, Faces, StaggeredGrid, at_centres

SMOKE_THRESHOLD = 0.01
"""Fraction of the largest density from which a voxel counts as smoke."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """The change between two densities around a velocity u_k: r + g . (u - u_k) = offset + direction . u."""

    direction: Faces
    """g at voxel centers, one array (nx, ny, nz) for each component."""
    offset: Array
    """(nx, ny, nz) float32: r - g . u_k."""
    carried: Array
    """(nx, ny, nz) float32: the density before, carried along by u_k, in the unit of `offset`."""
    weight: Array
    """(nx, ny, nz) float32: how far the change is taken for motion, 0 to 1."""
    smoke: npt.NDArray[np.bool_]
    """(nx, ny, nz) bool: where there is smoke."""
    scale: float
    """Density gradient that divides all of it: the root mean square in the smoke."""

    def with_dissipation(self, fraction: float) -> "Linearization":
        """The change that is left where a fraction of the smoke dissolves."""
        return replace(self, offset=self.offset + np.float32(fraction) * self.carried) if fraction else self

    def unexplained(self, u: StaggeredGrid, noise: float) -> tuple[float, float]:
        """Fraction of the squared change that a velocity leaves beyond noise of a variance, and all that it leaves."""
        left = self.offset + directional_derivative(self.direction, u.faces)
        whole, rest = (float(np.sum(self.weight * change**2, dtype=np.float64)) for change in (self.offset, left))
        floor = noise / self.scale**2 * float(np.sum(self.weight[self.smoke], dtype=np.float64))
        return (max(rest - floor, 0.0) / (whole - floor) if whole > floor else 1.0), rest


def linearize(before: Array, after: Array, weight: Array, u: StaggeredGrid) -> Linearization | None:
    """The change between densities around `u` (voxels per frame); None where there is no structure to follow."""
    carried = _core.advect_cells(before, u.faces, False, True)
    density = np.maximum(carried, after)
    smoke = density > np.float32(SMOKE_THRESHOLD) * density.max()
    direction = gradient(np.float32(0.5) * (carried + after))
    scale = rms_gradient(direction, smoke)
    if scale == 0:
        return None
    inverse = np.float32(1 / scale)
    for component in direction:
        component *= inverse
    offset = inverse * (after - carried) - directional_derivative(direction, u.faces)
    carried *= inverse
    return Linearization(direction, offset, carried, np.ascontiguousarray(weight), smoke, scale)


def gradient(cells: Array) -> Faces:
    """Central differences (nx, ny, nz) at voxel centers along x, y and z, one-sided at the sides of the box."""
    x, y, z = (np.gradient(cells, axis=axis) if cells.shape[axis] > 1 else np.zeros_like(cells) for axis in range(3))
    return x, y, z


def rms_gradient(components: Faces, smoke: npt.NDArray[np.bool_]) -> float:
    """Root mean square of a gradient in the smoke; 0 where there is none."""
    count = np.count_nonzero(smoke)
    squares = sum(float(np.sum(np.square(g[smoke]), dtype=np.float64)) for g in components)
    return float(np.sqrt(squares / count)) if count else 0.0


def directional_derivative(direction: Faces, faces: Faces) -> Array:
    """direction . u (nx, ny, nz), with the velocity u on faces taken to voxel centers."""
    x, y, z = (g * centered for g, centered in zip(direction, at_centres(faces), strict=True))
    x += y
    x += z
    return x


def least_squares(
    linear: Linearization,
    center: StaggeredGrid,
    *,
    kinetic: float,
    first_order: float = 0.0,
    second_order: float = 0.0,
    irrotational: float = 0.0,
) -> _core.LeastSquares:
    """The quadratic function of a velocity u: data term and regularization around a center.

    With v = u - center the weights are those of |v|^2, |grad v|^2, |grad curl v|^2, and |curl u|^2 outside the smoke.
    """
    return _core.LeastSquares(
        direction=linear.direction,
        offset=linear.offset,
        weight=linear.weight,
        irrotational=np.where(linear.smoke, np.float32(0), np.float32(irrotational)),
        center=center.faces,
        first_order=first_order,
        second_order=second_order,
        kinetic=kinetic,
        closed=center.walls,
    )
