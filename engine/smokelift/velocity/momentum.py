"""What smoke gains in momentum, fitted with a few numbers before anything else.

Smoke moves because it is pushed: hot smoke rises, a jet is blown, and the air round about follows. A push m in the
smoke alone sets the whole box in motion at P(m), with P the pressure projection. From rest

    m = density * (a + B x),     x from -1 to 1 over the box,

a and B are twelve numbers: enough for smoke that rises, leans, spreads or speeds up on its way. After a prediction m is
only the push of one frame, buoyancy say, and B = 0. The numbers are fitted by least squares to the same linearised
change as the velocity itself, together with the trust t in the prediction:

    min sum W (r + d before + g . (t u_p + P(m) - u_k))^2

and the share d of the smoke that dissolves or, below zero, that brightens, as a clip that flickers has it: either would
else be read as motion. The result is the centre of the whole regulariser.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from smokelift import _core
from smokelift.transport import Array, Faces

BRIGHTENING = 0.5
"""Without a prediction all of the smoke gets denser only where that leaves at most this share of what motion alone
leaves unexplained. Flicker does; smoke that enters would else be mistaken for it, and the flow above a fast inlet lost.
"""

RIDGE = 1e-3
"""Relative to the diagonal of the normal equations, so that what the smoke does not determine stays small."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """What the velocity should be near: `scale` times `faces` in voxels a frame."""

    faces: Faces
    scale: float

    def displacement(self) -> Faces:
        """In voxels a frame, on faces."""
        x, y, z = (np.float32(self.scale) * component for component in self.faces)
        return x, y, z


@dataclass(frozen=True, eq=False)
class Motion:
    """A centre for the regulariser.

    Attributes
    ----------
    trust
        Factor of the prediction, 0 to 1.
    thinning
        Share of the smoke that dissolves in a frame; below zero where all of it gets denser.
    push : (1 or 4, 3)
        Voxels a frame at density 1: constant, and along x, y, z, for each component.
    """

    trust: float
    thinning: float
    push: npt.NDArray[np.float64]

    def velocity(self, prediction: Prediction | None, density: Array, closed: list[bool], threads: int) -> Faces:
        """The motion t u_p + P(m) in voxels a frame, on faces."""
        faces, scale = (None, 0.0) if prediction is None else (prediction.faces, prediction.scale)
        x, y, z = _core.pushed(density, self.push, self.trust * scale, faces, closed, threads)
        return x, y, z

    def finer(self) -> Motion:
        """The same on a grid that is twice as fine."""
        return Motion(self.trust, self.thinning, 2 * self.push)


def fit_motion(
    prediction: Prediction | None,
    density: Array,
    direction: Faces,
    offset: Array,
    carried: Array,
    weight: Array,
    share: float,
    closed: list[bool],
    threads: int,
) -> Motion:
    """Fit trust and momentum to a linearised change.

    Parameters
    ----------
    prediction
        None if there is none.
    density : (nx, ny, nz) float32
        What momentum goes with.
    direction, offset, weight : (nx, ny, nz) float32
        The data term: sum of weight (offset + direction . u)^2.
    carried : (nx, ny, nz) float32
        The density before, carried along, in the same unit as `offset`.
    share
        Part of the fitted momentum that is kept.
    closed
        A flag for each side that is a wall.
    threads
        Processor cores.
    """

    def along(u: Faces | list[Array]) -> Array:
        return _core.directional(direction, u, threads)

    rows = 4 if prediction is None else 1
    pushes = np.eye(3 * rows).reshape(-1, rows, 3)
    columns = [along(_core.pushed(density, push, 0.0, None, closed, threads)) for push in pushes]
    if prediction is not None:
        columns.append(along(prediction.faces))
    products = _core.weighted_products([*columns, carried, offset], weight, threads)
    found, rest = _least_squares(products)
    thinning = float(found[-1])
    if thinning < 0 and prediction is None:
        kept = np.delete(np.arange(len(products)), -2)
        steady, without = _least_squares(products[np.ix_(kept, kept)])
        if rest > BRIGHTENING * without:
            thinning, found = 0.0, steady
    trust = 0.0 if prediction is None else float(np.clip(found[3 * rows] / prediction.scale, 0, 1))
    return Motion(trust, thinning, share * found[: 3 * rows].reshape(rows, 3))


def _least_squares(products: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], float]:
    """The factors x that make |offset + columns . x|^2 least, and what is left of it.

    From the products of all columns, the last the offset.
    """
    normal, right = products[:-1, :-1], -products[:-1, -1]
    size = np.sqrt(np.diag(normal)) + 1e-30
    scaled = normal / np.outer(size, size) + RIDGE * np.eye(len(size))
    found = np.linalg.solve(scaled, right / size) / size
    # LAPACK adds in an order of its own, which depends on where arrays lie; a run has to be the same to the bit
    found = found.astype(np.float32).astype(np.float64)
    return found, float(products[-1, -1] - 2 * right @ found + found @ normal @ found)
