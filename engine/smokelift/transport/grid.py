"""Velocities on the faces of voxels, and what they carry along.

The box is divided into cubes (voxels) of edge `voxel_size`. A velocity is stored on their faces (a MAC grid:
Harlow and Welch 1965), where its divergence and the pressure projection are exact. A velocity belongs to the
point of arrival: what is at x after a time step dt came from x - u(x) dt.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from smokelift import _core
from smokelift.scene import SIDES, Side

Array = npt.NDArray[np.float32]
Faces = tuple[Array, Array, Array]


@dataclass(frozen=True, eq=False)
class Velocity:
    """A velocity on the faces of voxels.

    Attributes
    ----------
    faces
        Normal velocities in m/s on x, y and z faces: float32 arrays of shape (nx+1, ny, nz),
        (nx, ny+1, nz) and (nx, ny, nz+1).
    voxel_size
        Edge of a voxel in metres.
    figures
        How it was found, if it was estimated: see `smokelift.velocity.estimate_velocity`.
    confidence
        Of an estimate, shape (nx, ny, nz), 0 to 1: how far the densities show the motion there; the rest is filled in
        by smoothness and incompressibility.
    source
        Of an estimate, shape (nx, ny, nz): density that enters per second, >= 0.
    unexplained
        Of an estimate, two on its grid: mean, and mean magnitude, of what it and those before it left of the change
        around each voxel. The next one tells sources by it.

    Raises
    ------
    ValueError
        If the shapes do not belong together, a value is not finite or the voxel size is not positive.
    """

    faces: Faces
    voxel_size: float
    figures: Mapping[str, float] = field(default_factory=dict)
    confidence: Array | None = None
    source: Array | None = None
    unexplained: tuple[Array, Array] | None = None

    def __post_init__(self) -> None:
        require_positive("voxel_size", self.voxel_size)
        faces = tuple(np.ascontiguousarray(component, np.float32) for component in self.faces)
        if len(faces) != 3 or any(component.ndim != 3 for component in faces):
            raise ValueError("faces must be three three-dimensional arrays.")
        nx, ny, nz = faces[0].shape[0] - 1, *faces[0].shape[1:]
        shapes = tuple(component.shape for component in faces)
        if min(nx, ny, nz) < 1 or shapes != face_shapes((nx, ny, nz)):
            raise ValueError(
                f"faces of shapes {shapes} do not belong to one box: "
                "expected (nx+1, ny, nz), (nx, ny+1, nz) and (nx, ny, nz+1)."
            )
        if not all(np.isfinite(component).all() for component in faces):
            raise ValueError("the velocity holds values that are not finite.")
        object.__setattr__(self, "faces", faces)

    @staticmethod
    def zero(shape: tuple[int, int, int], voxel_size: float) -> Velocity:
        """Smoke at rest in a box of `shape` voxels."""
        x, y, z = (np.zeros(n, np.float32) for n in face_shapes(shape))
        return Velocity((x, y, z), voxel_size)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along x, y and z."""
        ny, nz = self.faces[0].shape[1:]
        return self.faces[1].shape[0], ny, nz

    def centres(self) -> Array:
        """Velocity at voxel centres in m/s, shape (nx, ny, nz, 3): the mean of opposite faces."""
        return np.stack(at_centres(self.faces), axis=-1)

    def displacement(self, dt: float) -> Faces:
        """The way that smoke goes in `dt` seconds, in voxels, on faces."""
        x, y, z = (component * np.float32(dt / self.voxel_size) for component in self.faces)
        return x, y, z


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
        A scalar at voxel centres, shape (nx, ny, nz), or a velocity, each component of which is carried from
        its own positions.
    velocity
        What carries it, at the points of arrival.
    dt
        Time step in seconds. Steps of more than one voxel are fine.
    scheme
        ``"semi-lagrangian"`` is smooth and loses detail; ``"maccormack"`` (Selle et al. 2008) corrects the
        error of interpolation and keeps it. Both stay within the values around the point of origin.
    conserve
        For a density: restore the mass, which a flow without divergence keeps. On baked scenes MacCormack's steps gain
        0.6 % each, 2 to 50 % in sixteen; semi-Lagrangian ones lose 0.5 %, 2 to 14 %. What leaves through the sides
        is gone, nothing comes in. The repair is where interpolation is in doubt: where the two schemes differ, each
        voxel by no more than they do there; what is left then is shared by all smoke in proportion. It makes
        nothing negative and no smoke where there is none, and is no further from the truth (docs/measurements.md).

    Returns
    -------
    numpy.ndarray or Velocity
        Of the same shape. Scalars that come from outside the box are zero; a velocity continues beyond the
        box as on its side.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, `dt` is not positive, the scheme is unknown, or mass is to be
        kept of what has none: a velocity, or negative values.

    Notes
    -----
    The way back is one straight step, whatever its length. For an estimated velocity that is exact, since it is
    the displacement at arrival. In a physical one the path bends: in a swirl as wide as a box of 48 voxels the step
    misses the point of origin by 0.05 voxels at a voxel a step, by 0.4 at three and by 4.6 at ten. Yet on baked
    scenes of two to six voxels a frame neither a midpoint step nor two half steps paid: they predict the next
    velocity to 0.057 both, one step to 0.048, and the density carried by that to 0.052 both, one step to 0.048
    (benchmarks/velocity/transport.py). Those scenes were made with straight steps themselves.
    """
    require_positive("dt", dt)
    if scheme not in ("maccormack", "semi-lagrangian"):
        raise ValueError(f"unknown scheme {scheme!r}: expected 'maccormack' or 'semi-lagrangian'.")
    displacement = velocity.displacement(dt)
    corrected = scheme == "maccormack"
    if isinstance(field, Velocity):
        if conserve:
            raise ValueError("mass can be kept of a density, not of a velocity.")
        require_same_shape("the field", field.shape, velocity.shape)
        x, y, z = _core.advect_faces(field.faces, displacement, corrected)
        return Velocity((x, y, z), field.voxel_size)
    require_same_shape("the field", field.shape, velocity.shape)
    if not np.isfinite(field).all():
        raise ValueError("the field holds values that are not finite.")
    moved = _core.advect_cells(field, displacement, corrected)
    if not conserve:
        return moved
    if field.min() < 0:
        raise ValueError("mass can be kept of a density, not of negative values.")
    other = _core.advect_cells(field, displacement, not corrected)
    mass = float(np.sum(field * _share_inside(displacement), dtype=np.float64))
    return _with_mass(moved, np.abs(moved - other), mass)


def _with_mass(moved: Array, doubt: Array, mass: float) -> Array:
    """The density with another mass: changed up to the doubt about it, and in proportion beyond that."""
    change = np.minimum(doubt, moved)
    missing, changeable = mass - float(moved.sum(dtype=np.float64)), float(change.sum(dtype=np.float64))
    if changeable > 0:
        moved = moved + np.float32(np.clip(missing / changeable, -1, 1)) * change
    found = float(moved.sum(dtype=np.float64))
    return moved * np.float32(mass / found) if found > 0 else moved


def _share_inside(displacement: Faces) -> Array:
    """The part of every voxel that is still in the box after a step."""
    share = np.ones((), np.float32)
    for axis, along in enumerate(at_centres(displacement)):
        count = along.shape[axis]
        low = along + np.arange(count, dtype=np.float32).reshape([-1 if d == axis else 1 for d in range(3)])
        share = share * np.clip(np.minimum(low + 1, count - low), 0, 1)
    return share


def project(velocity: Velocity, closed: Iterable[Side] = ()) -> Velocity:
    """The nearest velocity without divergence (pressure projection).

    Nearest in the sum of squares over faces, those on open sides counted half, as they belong to half a
    voxel. Pressure is zero on open sides; closed sides (walls) let nothing through.

    Parameters
    ----------
    velocity
        Any velocity.
    closed
        Names of the sides that are walls: "x-", "x+", "y-", "y+", "z-", "z+".

    Returns
    -------
    Velocity
        Its figure ``"divergence"`` is max |div u| times voxel size over max |u|, around 1e-7.

    Raises
    ------
    ValueError
        If a side is unknown.
    """
    (x, y, z), divergence = _core.project(velocity.faces, closed_flags(closed))
    return Velocity((x, y, z), velocity.voxel_size, {"divergence": divergence})


def divergence(velocity: Velocity) -> Array:
    """Net outflow of every voxel per volume, in 1/s, shape (nx, ny, nz)."""
    return _core.divergence(velocity.faces) / np.float32(velocity.voxel_size)


def face_shapes(shape: tuple[int, ...]) -> tuple[tuple[int, int, int], ...]:
    """Shapes of the three arrays of face velocities of a box of `shape` voxels."""
    nx, ny, nz = shape
    return (nx + 1, ny, nz), (nx, ny + 1, nz), (nx, ny, nz + 1)


def at_centres(faces: Faces) -> Faces:
    """The three components of a face velocity at voxel centres: the mean of opposite faces."""
    half = np.float32(0.5)
    x, y, z = faces
    return half * (x[1:] + x[:-1]), half * (y[:, 1:] + y[:, :-1]), half * (z[:, :, 1:] + z[:, :, :-1])


def closed_flags(closed: Iterable[Side]) -> list[bool]:
    """Names of walls as one flag a side, in the order of `SIDES`; ValueError for an unknown name."""
    names = set(closed)
    if unknown := names - set(SIDES):
        raise ValueError(f"unknown side {sorted(unknown)[0]!r}: expected some of {', '.join(SIDES)}.")
    return [side in names for side in SIDES]


def require_positive(name: str, value: float) -> None:
    """Refuse what is not a positive finite number."""
    if not (value > 0 and math.isfinite(value)):
        raise ValueError(f"{name} must be positive and finite, not {value}.")


def require_same_shape(what: str, shape: tuple[int, ...], expected: tuple[int, ...]) -> None:
    """Refuse an array that does not fit the box."""
    if tuple(shape) != tuple(expected):
        raise ValueError(f"{what} has shape {tuple(shape)}, but the box has {tuple(expected)} voxels.")
