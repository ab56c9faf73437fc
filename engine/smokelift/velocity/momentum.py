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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from smokelift import _core
from smokelift.transport import Array, Faces, at_centres, face_shapes

RIDGE = 1e-3
"""Relative to the diagonal of the normal equations, so that what the smoke does not determine stays small."""


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

    def velocity(self, prediction: Faces, density: Array, closed: list[bool], threads: int) -> Faces:
        """The motion t u_p + P(m) in voxels a frame, on faces."""
        x, y, z = _pushed(density, self.push, closed, threads)
        t = np.float32(self.trust)
        return (x + t * prediction[0], y + t * prediction[1], z + t * prediction[2]) if t else (x, y, z)

    def finer(self) -> Motion:
        """The same on a grid that is twice as fine."""
        return Motion(self.trust, self.thinning, 2 * self.push)


def fit_motion(
    prediction: Faces,
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
        In voxels a frame on faces; zero if there is none.
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
    predicted = any(component.any() for component in prediction)
    counted = (weight > 0) & ((direction[0] != 0) | (direction[1] != 0) | (direction[2] != 0) | (carried > 0))
    root = np.sqrt(weight[counted])
    g = [root * component[counted] for component in direction]

    def along(u: Faces) -> Array:
        x, y, z = at_centres(u)
        total: Array = g[0] * x[counted] + g[1] * y[counted] + g[2] * z[counted]
        return total

    rows = 1 if predicted else 4
    pushes = np.eye(3 * rows).reshape(-1, rows, 3)
    columns = [along(_pushed(density, push, closed, threads)) for push in pushes]
    if predicted:
        columns.append(along(prediction))
    thinned = root * carried[counted]
    found = _least_squares([*columns, thinned], root * offset[counted])
    thinning = float(found[-1])
    trust = float(np.clip(found[3 * rows], 0, 1)) if predicted else 0.0
    return Motion(trust, thinning, share * found[: 3 * rows].reshape(rows, 3))


def _least_squares(columns: list[Array], offset: Array) -> npt.NDArray[np.float64]:
    """The factors x that make offset + columns . x least."""
    matrix = np.stack(columns).astype(np.float64)
    normal, right = matrix @ matrix.T, -matrix @ offset
    size = np.sqrt(np.diag(normal)) + 1e-30
    scaled = normal / np.outer(size, size) + RIDGE * np.eye(len(size))
    found = np.linalg.solve(scaled, right / size) / size
    # BLAS adds in an order of its own, which depends on where arrays lie; a run has to be the same to the bit each time
    return found.astype(np.float32).astype(np.float64)


def _pushed(density: Array, push: npt.NDArray[np.float64], closed: list[bool], threads: int) -> Faces:
    """The motion of the whole box that a push in the smoke makes, P(m)."""
    faces = []
    for axis, shape in enumerate(face_shapes(density.shape)):
        component = np.zeros(shape, np.float32)
        constant, *slopes = push[:, axis].astype(np.float32)
        if constant or any(slopes):
            profile = constant + sum(slope * x for slope, x in zip(slopes, _axes(density.shape), strict=False))
            pushed = density * profile
            low, high = _along(axis, slice(None, -1)), _along(axis, slice(1, None))
            component[_along(axis, slice(1, -1))] = np.float32(0.5) * (pushed[low] + pushed[high])
        faces.append(component)
    (x, y, z), _ = _core.project(faces, closed, passes=1, threads=threads)
    return x, y, z


def _axes(shape: tuple[int, ...]) -> Iterator[Array]:
    """x, y and z, from -1 to 1 over the box."""
    for axis, count in enumerate(shape):
        yield np.linspace(-1, 1, count, dtype=np.float32).reshape([-1 if d == axis else 1 for d in range(3)])


def _along(axis: int, part: slice) -> tuple[slice, ...]:
    return tuple(part if d == axis else slice(None) for d in range(3))
