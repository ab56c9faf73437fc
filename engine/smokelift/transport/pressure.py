"""Divergence, and the pressure projection that removes it, also with faces whose velocity is given."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

import smokelift._core as _core
from smokelift.checks import Array, Mask, require_kind
from smokelift.scene import Side
from smokelift.transport.grid import Faces, StaggeredGrid, Velocity

FaceMasks = tuple[Mask, Mask, Mask]

TOLERANCE = 1e-3
"""Gradient over the first one at which the iteration ends."""


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


def project_with_given_faces(
    field: StaggeredGrid, given: FaceMasks, wanted: Faces, *, limit: int = 60
) -> StaggeredGrid:
    """The nearest field without divergence that has the values wanted on the given faces; others do not count.

    Let P be the projection on the fields without divergence and M the restriction to the given faces. Among the fields
    u = P u that make |M (u - wanted)| least, the one nearest to P u0 is found by conjugate gradients on

        P M P u = P M wanted,    from u = P u0.

    Every iteration is one direct Poisson solve, all iterates are without divergence, and each reduces |M (u - wanted)|.
    Forces on the given faces make up the difference from P u0: the immersed boundary projection of Taira and Colonius
    (2007), with faces in place of points.

    Where no field without divergence has them, the nearest are taken. The iteration ends at a `TOLERANCE` relative to
    the first gradient, or after `limit` rounds.
    """
    # a face on a side of the box belongs to half a voxel
    weights = np.ix_(*(np.r_[0.5, np.ones(count - 1), 0.5].astype(np.float32) for count in field.shape))

    def projected(faces: list[Array]) -> list[Array]:
        return list(without_divergence(field.with_faces(faces))[0].faces)

    def product(a: list[Array], b: list[Array]) -> float:
        return sum(float(np.vdot(w * p, q)) for w, p, q in zip(weights, a, b, strict=True))

    def restricted(faces: list[Array]) -> list[Array]:
        return [np.where(mask, values, np.float32(0)) for mask, values in zip(given, faces, strict=True)]

    solution = projected(list(field.faces))
    residual = projected(restricted([v - u for v, u in zip(wanted, solution, strict=True)]))
    squared = product(residual, residual)
    goal, search = TOLERANCE**2 * squared, residual
    for _ in range(limit):
        if squared <= goal:
            break
        on_given = restricted(search)
        step = np.float32(squared / product(on_given, on_given))
        solution = [u + step * s for u, s in zip(solution, search, strict=True)]
        residual = [a - step * r for a, r in zip(residual, projected(on_given), strict=True)]
        before, squared = squared, product(residual, residual)
        ratio = np.float32(squared / before)
        search = [a + ratio * s for a, s in zip(residual, search, strict=True)]
    return field.with_faces(solution)


def faces_of(voxels: Mask) -> FaceMasks:
    """The faces of marked voxels (nx, ny, nz), those on the sides of the box among them."""
    x, y, z = (low | high for low, high in _beside(voxels))
    return x, y, z


def faces_between(voxels: Mask) -> FaceMasks:
    """The faces with a marked voxel (nx, ny, nz) on one side and none on the other."""
    x, y, z = (low ^ high for low, high in _beside(voxels))
    return x, y, z


def _beside(voxels: Mask) -> Iterator[tuple[Mask, Mask]]:
    """Whether the voxels below and above the faces of each axis are marked."""
    for axis in range(3):
        below, above = (np.pad(voxels, [end if d == axis else (0, 0) for d in range(3)]) for end in ((1, 0), (0, 1)))
        yield below, above
