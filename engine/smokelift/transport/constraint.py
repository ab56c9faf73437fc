"""The pressure projection with faces whose velocity is given: solid obstacles, and what is known of a flow.

Let P be the projection on the velocities without divergence and M the restriction to the given faces. Among the
velocities u = P u that make |M (u - wanted)| least, the one nearest to P u0 is found by conjugate gradients on

    P M P u = P M wanted,    from u = P u0.

Every iteration is one direct Poisson solve, all iterates are without divergence, and each reduces |M (u - wanted)|.
Forces on the given faces make up the difference from P u0: the immersed boundary projection of Taira and Colonius
(2007), with faces in place of points.
"""

from collections.abc import Iterator

import numpy as np

from smokelift.checks import Mask
from smokelift.transport import Array, Faces, StaggeredGrid, without_divergence

FaceMasks = tuple[Mask, Mask, Mask]

TOLERANCE = 1e-3
"""Gradient over the first one at which the iteration ends."""


def project_with_given_faces(
    field: StaggeredGrid, given: FaceMasks, wanted: Faces, *, limit: int = 60
) -> StaggeredGrid:
    """The nearest field without divergence that has the values wanted on the given faces; others do not count.

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
