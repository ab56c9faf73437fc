"""The quadratic problem that two densities pose: prepared, their change linearized, and its center fitted.

Preparation (`prepare`). Noise is blurred: white noise is as strong in the finest scale, where neighbors alternate along
all axes at once, as in any other, and smoke has next to nothing there. So the median of that scale's magnitude inside
the smoke measures the noise and not the smoke (Donoho and Johnstone 1994). It chooses the blur: gradients have to stand
out from what noise makes of them. Contrast is reduced: any function of a density is carried along just like the
density. With the density itself the thick smoke at the base of a plume decides everything; with its power of 3/4 thin
smoke counts as well (docs/experiments/velocity-solver.md). Noise would count as well, so noisy densities are followed
as they are. So are smooth ones.

Center (`fit_center`). Forces act on the smoke: hot smoke rises, a jet is blown, and the air around follows. A momentum
source m in the smoke alone sets the whole box in motion at P(m), with P the pressure projection. From rest

    m = density * (a + B x),     x from -1 to 1 over the box,

a and B are twelve numbers: enough for smoke that rises, leans, spreads or speeds up on its way. After a prediction m is
only the momentum gained in one frame, by buoyancy say, and B = 0. The numbers are fitted by least squares to the same
linearized change as the velocity itself, together with the trust t in the prediction and the dissipation d:

    min sum W (r + d before + g . (t u_p + P(m) - u_k))^2

d is the fraction of the smoke that dissolves. Below zero smoke gets denser, as in a clip that flickers. Without d
either would be fitted as motion. The regularizer penalises the distance from the velocity that is fitted here.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Doubles, Mask
from smokelift.transport import Array, Faces, StaggeredGrid, at_centres, without_divergence

SMOKE_THRESHOLD = 0.01
"""Fraction of the largest density from which a voxel counts as smoke."""

BLUR = 0.5
"""Standard deviation (voxels) of the Gaussian that smooths densities which are neither smooth nor noisy."""

NOISE = 0.35
"""Allowed noise in the difference of two densities, divided by the root mean square gradient: voxels of motion
(docs/experiments/velocity-solver.md)."""

SMOOTH = 0.045
"""Noise in the same unit below which densities are smooth already, and neither blurred nor compressed
(docs/experiments/velocity-solver.md)."""

MAD = 0.6745
"""Median magnitude of a normal variable, in standard deviations (by definition)."""

ATTEMPTS = (
    (False, 0.0, SMOOTH),
    (True, BLUR, NOISE),
    (False, BLUR, NOISE),
    (False, 1.0, NOISE),
    (False, 1.5, NOISE),
    (False, 2.0, NOISE),
)
"""Whether contrast is reduced, the standard deviation of the blur (voxels), and the noise that may be left: the first
that leaves no more is taken, else the last. Smooth densities stay as they are, and noisy ones are only blurred."""

MOMENTUM = 0.8
"""Fraction of the fitted momentum that an estimate without a prediction starts from. Below one, because the fit is to
noise as well (docs/experiments/velocity-solver.md)."""

BRIGHTENING = 0.5
"""Without a prediction, overall brightening is allowed only if it cuts the unexplained change to this fraction. Flicker
does; smoke that enters does not (docs/experiments/velocity-solver.md)."""

RIDGE = 1e-3
"""Ridge over the diagonal of the normal equations: what the smoke does not determine stays small."""


@dataclass(frozen=True, eq=False)
class PreparedPair:
    """Two densities (nx, ny, nz) as their motion is estimated from: blurred, and perhaps with less contrast.

    `noise` is the variance of the noise that is left in their difference. If `reduced`, they are the power of 3/4 of
    the densities.
    """

    before: Array
    after: Array
    noise: float
    reduced: bool

    def density_dissipation(self, fraction: float) -> float:
        """The fraction of the density that dissolves where a fraction of the values does."""
        return float(1 - (1 - fraction) ** (4 / 3)) if self.reduced else fraction


def prepare(before: Array, after: Array) -> PreparedPair:
    """Blur two densities and reduce their contrast, as the first of `ATTEMPTS` that leaves little noise."""
    for reduced, width, allowed in ATTEMPTS:
        first, second = (np.sqrt(a) * np.sqrt(np.sqrt(a)) if reduced else a for a in (before, after))
        smoke = second > SMOKE_THRESHOLD * second.max()
        raw = float(np.hypot(_noise_level(first, smoke), _noise_level(second, smoke)))
        first, second, left = blurred(first, width), blurred(second, width), raw * _passed(width)
        if left <= allowed * _rms_gradient(_gradient(second), smoke):
            break
    return PreparedPair(first, second, left**2, reduced)


def _noise_level(density: Array, smoke: Mask) -> float:
    """Standard deviation of white noise in a density, from its finest scale inside the smoke."""
    finest, inside = density, smoke
    for axis in range(3):
        finest = np.diff(finest, axis=axis) / np.float32(np.sqrt(2.0))
        inside = np.delete(inside, 0, axis) & np.delete(inside, -1, axis)
    if not inside.any():
        return 0.0
    return float(np.median(np.abs(finest[inside]))) / MAD


def blurred(density: Array, width: float) -> Array:
    """A density blurred by a standard deviation in voxels, 0 for none."""
    return _core.blur(density, width, 4.0) if width > 0 else density


def _passed(width: float) -> float:
    """Fraction of white noise's standard deviation that a Gaussian lets through."""
    if width <= 0:
        return 1.0
    spike = np.zeros(int(8 * width) * 2 + 3)
    spike[len(spike) // 2] = 1
    kernel = ndimage.gaussian_filter1d(spike, width)
    return float(np.sum(kernel**2) ** 1.5)


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
    smoke: Mask
    """(nx, ny, nz) bool: where there is smoke."""
    scale: float
    """Density gradient that divides all of it: the root mean square in the smoke."""

    def with_dissipation(self, fraction: float) -> "Linearization":
        """The change that is left where a fraction of the smoke dissolves."""
        return replace(self, offset=self.offset + np.float32(fraction) * self.carried) if fraction else self

    def unexplained_fraction(self, u: StaggeredGrid, noise: float) -> tuple[float, float]:
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
    direction = _gradient(np.float32(0.5) * (carried + after))
    scale = _rms_gradient(direction, smoke)
    if scale == 0:
        return None
    inverse = np.float32(1 / scale)
    for component in direction:
        component *= inverse
    offset = inverse * (after - carried) - directional_derivative(direction, u.faces)
    carried *= inverse
    return Linearization(direction, offset, carried, np.ascontiguousarray(weight), smoke, scale)


def _gradient(cells: Array) -> Faces:
    """Central differences (nx, ny, nz) at voxel centers along x, y and z, one-sided at the sides of the box."""
    x, y, z = (np.gradient(cells, axis=axis) if cells.shape[axis] > 1 else np.zeros_like(cells) for axis in range(3))
    return x, y, z


def _rms_gradient(components: Faces, smoke: Mask) -> float:
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


def fit_center(
    prediction: StaggeredGrid | None, density: Array, linear: Linearization, grid: StaggeredGrid
) -> tuple[StaggeredGrid, float, float]:
    """The motion around which the velocity is regularized, t u_p + P(m), the trust t, from 0 to 1, and the dissipation.

    All are fitted to a linearized change. The dissipation is the fraction of the smoke that dissolves in a frame, at
    most 1. The prediction is in voxels per frame, as the motion is, and the density (nx, ny, nz) is what momentum goes
    with. ``grid`` is any field on the estimate's grid.
    """
    rows = 4 if prediction is None else 1
    columns = [
        directional_derivative(linear.direction, _set_in_motion(density, momentum, grid).faces)
        for momentum in np.eye(3 * rows).reshape(-1, rows, 3)
    ]
    if prediction is not None:
        columns.append(directional_derivative(linear.direction, prediction.faces))
    products = _weighted_products([*columns, linear.carried, linear.offset], linear.weight)
    found, rest = _fitted(products)
    dissipation = min(float(found[-1]), 1.0)  # where smoke vanishes the linearized change may ask for more than all
    if dissipation < 0 and prediction is None:
        others = np.delete(np.arange(len(products)), -2)
        without_dissipation, left = _fitted(products[np.ix_(others, others)])
        if rest > BRIGHTENING * left:
            dissipation, found = 0.0, without_dissipation
    momentum = found[: 3 * rows].reshape(rows, 3)
    if prediction is None:
        return _set_in_motion(density, MOMENTUM * momentum, grid), 0.0, dissipation
    trust = float(np.clip(found[3], 0, 1))
    gained = _set_in_motion(density, momentum, grid)
    faces = zip(gained.faces, prediction.faces, strict=True)
    return grid.with_faces(own + np.float32(trust) * predicted for own, predicted in faces), trust, dissipation


def _set_in_motion(density: Array, momentum: Doubles, grid: StaggeredGrid) -> StaggeredGrid:
    """The motion P(m) in voxels per frame that a momentum (1 or 4, 3) in the smoke sets off.

    It is in voxels per frame at density 1: constant, and along x, y, z, for each component.
    """
    axes = np.meshgrid(*(np.linspace(-1, 1, n, dtype=np.float32) for n in density.shape), indexing="ij", sparse=True)
    faces = StaggeredGrid.zero(density.shape, 1.0).faces
    for along, (constant, *slopes) in enumerate(momentum.T.astype(np.float32)):
        if not constant and not any(slopes):
            continue
        change = sum((slope * axis for slope, axis in zip(slopes, axes, strict=False)), start=constant)
        gain = np.moveaxis(density * change, along, 0)
        # faces on the sides of the box gain none
        np.moveaxis(faces[along], along, 0)[1:-1] = np.float32(0.5) * (gain[1:] + gain[:-1])
    return without_divergence(grid.with_faces(faces))[0]


def _weighted_products(columns: list[Array], weight: Array) -> Doubles:
    """Sums over the voxels of weight a b for all pairs of the columns, shape (columns, columns)."""
    products = np.zeros((len(columns), len(columns)))
    for slabs in zip(weight, *columns, strict=True):
        rows = np.stack(slabs[1:]).reshape(len(columns), -1).astype(np.float64)
        # unlike a product by BLAS, which adds in an order of its own, it is the same to the bit wherever arrays lie
        products += np.einsum("an,bn->ab", rows * slabs[0].reshape(-1), rows)
    return products


def _fitted(products: Doubles) -> tuple[Doubles, float]:
    """The factors x that make |offset + columns . x|^2 least, and what is left of it.

    ``products`` are those of all columns, the last one the offset.
    """
    normal, right = products[:-1, :-1], -products[:-1, -1]
    size = np.sqrt(np.diag(normal)) + 1e-30
    scaled = normal / np.outer(size, size) + RIDGE * np.eye(len(size))
    found = np.linalg.solve(scaled, right / size) / size
    # LAPACK adds in an order of its own, which depends on where arrays lie; a run has to be the same to the bit
    found = found.astype(np.float32).astype(np.float64)
    return found, float(products[-1, -1] - 2 * right @ found + found @ normal @ found)
