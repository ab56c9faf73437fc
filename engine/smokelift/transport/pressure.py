"""Divergence, and the pressure projection that removes it."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

import smokelift._core as _core
from smokelift.checks import Array, require_kind
from smokelift.scene import Side
from smokelift.transport.grid import StaggeredGrid, Velocity


def project(velocity: Velocity, closed: Iterable[Side] | None = None) -> Velocity:
    """The nearest velocity without divergence (pressure projection).

    Nearest in the sum of squares over faces, those on open sides counted half, as they belong to half a
    voxel. Pressure is zero on open sides; closed sides (walls) let nothing through.

    Parameters
    ----------
    velocity
        Any velocity.
    closed
        Names of the sides that are walls: "x-", "x+", "y-", "y+", "z-", "z+". None takes those of the velocity.

    Returns
    -------
    Velocity
        Its figure ``"divergence"`` is max |div u| times voxel size over max |u|, around 1e-7.

    Raises
    ------
    ValueError
        If a side is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from smokelift import Velocity, project
    >>> faces = np.zeros((9, 8, 8)), np.zeros((8, 9, 8)), np.zeros((8, 8, 9))
    >>> faces[2][4, 4, 4] = 1
    >>> calm = project(Velocity(faces, voxel_size=0.1), closed=["z-"])
    >>> bool(calm.figures["divergence"] < 1e-5)
    True
    """
    require_kind(velocity, Velocity, "velocity", "a Velocity")
    if closed is not None:
        velocity = replace(velocity, closed=tuple(closed))
    grid, largest = without_divergence(velocity, passes=2)
    return Velocity(grid.faces, velocity.voxel_size, velocity.closed, figures={"divergence": largest})


def without_divergence(field: StaggeredGrid, passes: int = 1) -> tuple[StaggeredGrid, float]:
    """The nearest field without divergence, and max |div u| times voxel size over max |u| of that.

    A second pass removes what rounding leaves of a large divergence.
    """
    faces, largest = _core.project(field.faces, field.walls, passes=passes)
    return StaggeredGrid((faces[0], faces[1], faces[2]), field.voxel_size, field.closed), largest


def outflow(sources: Array, like: StaggeredGrid) -> StaggeredGrid:
    """The field that is the gradient of something and has a given net outflow (nx, ny, nz) from every voxel.

    That is the sum over a voxel's six faces, outwards. With all sides closed its mean is left out, as it cannot get
    away.
    """
    pressure = _core.solve_poisson(sources, like.walls)
    faces = []
    for axis in range(3):
        low, high = (np.float32(1 if wall else -1) for wall in like.walls[2 * axis : 2 * axis + 2])
        ends = low * pressure.take([0], axis), high * pressure.take([-1], axis)
        faces.append(-np.diff(np.concatenate([ends[0], pressure, ends[1]], axis), axis=axis))
    return like.with_faces(faces)


def divergence(field: StaggeredGrid) -> Array:
    """Net outflow of every voxel per volume, shape (nx, ny, nz); of a velocity in 1/s."""
    return _core.divergence(field.faces) / np.float32(field.voxel_size)
