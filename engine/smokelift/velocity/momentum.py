"""The momentum that smoke gains, fitted with a few numbers before anything else.

Forces act on the smoke: hot smoke rises, a jet is blown, and the air around follows. A momentum source m in the smoke
alone sets the whole box in motion at P(m), with P the pressure projection. From rest

    m = density * (a + B x),     x from -1 to 1 over the box,

a and B are twelve numbers: enough for smoke that rises, leans, spreads or speeds up on its way. After a prediction m is
only the momentum gained in one frame, by buoyancy say, and B = 0. The numbers are fitted by least squares to the same
linearized change as the velocity itself, together with the trust t in the prediction and the dissipation d:

    min sum W (r + d before + g . (t u_p + P(m) - u_k))^2

d is the fraction of the smoke that dissolves. Below zero smoke gets denser, as in a clip that flickers. Without d
either would be fitted as motion. The regularizer penalises the distance from the velocity that is fitted here.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from smokelift.transport import Array, StaggeredGrid, without_divergence
from smokelift.velocity.linearization import Linearization, directional_derivative

MOMENTUM = 0.8
"""Fraction of the fitted momentum that an estimate without a prediction starts from. Below one, because the fit is to
noise as well (docs/experiments/velocity-solver.md)."""

BRIGHTENING = 0.5
"""Without a prediction, overall brightening is allowed only if it cuts the unexplained change to this fraction. Flicker
does; smoke that enters does not (docs/experiments/velocity-solver.md)."""

RIDGE = 1e-3
"""Ridge over the diagonal of the normal equations: what the smoke does not determine stays small."""


@dataclass(frozen=True, eq=False)
class Center:
    """The motion around which the velocity is regularized: t u_p + P(m), in voxels per frame.

    `trust` is t, from 0 to 1. `dissipation` is the fraction of the smoke that dissolves in a frame, at most 1 and
    below zero where all of it gets denser.
    """

    motion: StaggeredGrid
    trust: float
    dissipation: float


def fit_center(prediction: StaggeredGrid | None, density: Array, linear: Linearization, grid: StaggeredGrid) -> Center:
    """Fit trust, momentum and dissipation to a linearized change.

    The prediction is in voxels per frame, and the density (nx, ny, nz) is what momentum goes with. ``grid`` is any
    field on the estimate's grid.
    """
    rows = 4 if prediction is None else 1
    columns = [
        directional_derivative(linear.direction, _set_in_motion(density, momentum, grid).faces)
        for momentum in np.eye(3 * rows).reshape(-1, rows, 3)
    ]
    if prediction is not None:
        columns.append(directional_derivative(linear.direction, prediction.faces))
    products = _weighted_products([*columns, linear.carried, linear.offset], linear.weight)
    found, rest = _least_squares(products)
    dissipation = min(float(found[-1]), 1.0)  # where smoke vanishes the linearized change may ask for more than all
    if dissipation < 0 and prediction is None:
        others = np.delete(np.arange(len(products)), -2)
        without_dissipation, left = _least_squares(products[np.ix_(others, others)])
        if rest > BRIGHTENING * left:
            dissipation, found = 0.0, without_dissipation
    momentum = found[: 3 * rows].reshape(rows, 3)
    if prediction is None:
        return Center(_set_in_motion(density, MOMENTUM * momentum, grid), 0.0, dissipation)
    trust = float(np.clip(found[3], 0, 1))
    gained = _set_in_motion(density, momentum, grid)
    faces = zip(gained.faces, prediction.faces, strict=True)
    return Center(grid.with_faces(own + np.float32(trust) * predicted for own, predicted in faces), trust, dissipation)


def _set_in_motion(density: Array, momentum: npt.NDArray[np.float64], grid: StaggeredGrid) -> StaggeredGrid:
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


def _weighted_products(columns: list[Array], weight: Array) -> npt.NDArray[np.float64]:
    """Sums over the voxels of weight a b for all pairs of the columns, shape (columns, columns)."""
    products = np.zeros((len(columns), len(columns)))
    for slabs in zip(weight, *columns, strict=True):
        rows = np.stack(slabs[1:]).reshape(len(columns), -1).astype(np.float64)
        # unlike a product by BLAS, which adds in an order of its own, it is the same to the bit wherever arrays lie
        products += np.einsum("an,bn->ab", rows * slabs[0].reshape(-1), rows)
    return products


def _least_squares(products: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], float]:
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
