"""Semi-Lagrangian advection of densities and velocities."""

import math
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt

import smokelift._core as _core
from smokelift.checks import Array, numbers, require_kind
from smokelift.scene.domain import box_around
from smokelift.transport.grid import StaggeredGrid, Velocity, at_centres, faces_in, finite, require_same_shape

Carried = TypeVar("Carried", npt.NDArray[np.floating[Any]], Velocity)


def advect(
    field: Carried,
    velocity: Velocity,
    dt: float,
    *,
    scheme: Literal["maccormack", "semi-lagrangian"] = "maccormack",
    conserve: bool = False,
) -> Carried:
    """Carry a density or a velocity along for one time step.

    Parameters
    ----------
    field
        A scalar at voxel centers, shape (nx, ny, nz), or a velocity, each component of which is carried from
        its own positions.
    velocity
        What carries it, at the points of arrival.
    dt
        Time step in seconds. Steps of more than one voxel are fine.
    scheme
        ``"semi-lagrangian"`` is smooth and loses detail; ``"maccormack"`` (Selle et al. 2008) corrects the
        error of interpolation and keeps it. Both stay within the values around the point of origin.
    conserve
        For a density: restore the mass, which a flow without divergence keeps. Mass that leaves through open sides is
        gone; none comes in. The repair goes where interpolation is in doubt, that is, where the two schemes differ,
        and changes each voxel by no more than they differ there. All smoke shares the rest in proportion. The repair
        makes nothing negative and no smoke where there is none. docs/experiments/velocity-solver.md has the drift
        without it.

    Returns
    -------
    numpy.ndarray or Velocity
        Of the same shape. Scalars that come from outside the box are zero; a velocity continues beyond the
        box as on its side.

    Raises
    ------
    ValueError
        If the shapes differ, a value or the way in `dt` is not finite, `dt` is not positive, the scheme is unknown,
        or mass is to be kept of what has none: a velocity, or negative values.

    Notes
    -----
    The way back is one straight step, whatever its length. For an estimated velocity that is exact, since it is
    the displacement at arrival. A physical path bends, but neither a midpoint step nor two half steps predict baked
    scenes better (docs/experiments/velocity-solver.md).

    Examples
    --------
    >>> import numpy as np
    >>> from smokelift import Velocity, advect
    >>> faces = np.zeros((9, 8, 8)), np.zeros((8, 9, 8)), np.ones((8, 8, 9))  # 1 m/s upwards
    >>> wind = Velocity(faces, voxel_size=0.1)
    >>> smoke = np.zeros((8, 8, 8))
    >>> smoke[4, 4, 2] = 1
    >>> float(advect(smoke, wind, dt=0.1)[4, 4, 3])
    1.0
    """
    if scheme not in ("maccormack", "semi-lagrangian"):
        raise ValueError(f"unknown scheme {scheme!r}: expected 'maccormack' or 'semi-lagrangian'.")
    require_kind(velocity, Velocity, "velocity", "a Velocity")
    displacement = velocity.displacement(dt)
    corrected = scheme == "maccormack"
    if not isinstance(field, Velocity):
        field = numbers(field, "the field")
    require_same_shape("the field", field.shape, velocity.shape)
    if isinstance(field, Velocity):
        if conserve:
            raise ValueError("mass can be kept for a density, not for a velocity; leave it out.")
        x, y, z = _core.advect_faces(field.faces, displacement.faces, corrected)
        return Velocity((x, y, z), field.voxel_size, field.closed)
    if not finite(field):
        raise ValueError("the field holds values that are not finite; set them to 0.")
    if not conserve:
        return _moved(field, displacement, corrected)
    moved = _core.advect_cells(field, displacement.faces, corrected)
    if field.min() < 0:
        raise ValueError("mass can be kept for a density, not for negative values; leave it out.")
    other = _core.advect_cells(field, displacement.faces, not corrected)
    mass = float(np.sum(field * fraction_inside(displacement), dtype=np.float64))
    return _with_mass(moved, np.abs(moved - other), mass)


def _moved(field: Array, displacement: StaggeredGrid, corrected: bool) -> Array:
    """Carry a density along, computed where it can arrive alone."""
    # what arrives was a step away, and the correction looks a step further
    farthest = max(max(-float(along.min()), float(along.max())) for along in displacement.faces)
    box = box_around(field != 0, 2 * (math.ceil(farthest) + 1))
    result: Array = np.zeros(field.shape, np.float32)
    if result[box].size:
        result[box] = _core.advect_cells(field[box], faces_in(displacement.faces, box), corrected)
    return result


def _with_mass(moved: Array, doubt: Array, mass: float) -> Array:
    """The density with another mass: changed up to the doubt about it, and in proportion beyond that."""
    change = np.minimum(doubt, moved)
    missing, changeable = mass - float(moved.sum(dtype=np.float64)), float(change.sum(dtype=np.float64))
    if changeable > 0:
        moved = moved + np.float32(np.clip(missing / changeable, -1, 1)) * change
    found = float(moved.sum(dtype=np.float64))
    return moved * np.float32(mass / found) if found > 0 else moved


def fraction_inside(displacement: StaggeredGrid) -> Array:
    """The part of every voxel that is still in the box after a step: nothing leaves through walls."""
    fraction = np.ones((), np.float32)
    for axis, along in enumerate(at_centres(displacement.faces)):
        count, (low_wall, high_wall) = along.shape[axis], displacement.walls[2 * axis : 2 * axis + 2]
        low = along + np.arange(count, dtype=np.float32).reshape([-1 if d == axis else 1 for d in range(3)])
        ends = np.float32(1) if low_wall else low + 1, np.float32(1) if high_wall else count - low
        fraction = fraction * np.clip(np.minimum(*ends), 0, 1)
    return fraction
