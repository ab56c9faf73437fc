"""The staggered grid: vectors on the faces of voxels, with their spacing and their boundary.

The box is divided into cubes (voxels). A vector field is stored as its normal components on their faces (a MAC grid:
Harlow and Welch 1965), where its divergence and the pressure projection are exact.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self, TypeVar

import numpy as np
import numpy.typing as npt

from smokelift.checks import Array, numbers, shown
from smokelift.scene import SIDES, Side
from smokelift.scene.checks import LARGEST, SMALLEST, set_fields
from smokelift.scene.domain import checked_sides

Faces = tuple[Array, Array, Array]
VoxelBox = tuple[slice, slice, slice]
Real = TypeVar("Real", np.float32, np.float64)


@dataclass(frozen=True, eq=False)
class StaggeredGrid:
    """A vector field on the faces of voxels.

    Attributes
    ----------
    faces
        Normal components on x, y and z faces: float32 arrays of shape (nx+1, ny, nz), (nx, ny+1, nz) and
        (nx, ny, nz+1).
    voxel_size
        Edge of a voxel, in meters or in any unit that suits the field.
    closed
        Sides of the box that are walls, some of `SIDES`. The others are open.

    Raises
    ------
    ValueError
        If the shapes do not belong together, the voxel size is not positive or a side is unknown.
    """

    faces: Faces
    voxel_size: float
    closed: tuple[Side, ...] = ()

    def __post_init__(self) -> None:
        require_positive("voxel_size", self.voxel_size)
        if not isinstance(self.faces, Sequence) or len(self.faces) != 3:
            raise ValueError("faces must be three arrays, of the components on x, y and z faces.")
        x, y, z = (np.ascontiguousarray(numbers(component, "faces")) for component in self.faces)
        if any(component.ndim != 3 for component in (x, y, z)):
            raise ValueError("faces must be three three-dimensional arrays; Velocity.zero shows their shapes.")
        shape = (x.shape[0] - 1, *x.shape[1:])
        shapes = (x.shape, y.shape, z.shape)
        if min(shape) < 1 or shapes != face_shapes(shape):
            raise ValueError(
                f"faces of shapes {shapes} do not belong to one box: "
                "expected (nx+1, ny, nz), (nx, ny+1, nz) and (nx, ny, nz+1)."
            )
        set_fields(self, faces=(x, y, z), closed=checked_sides(self.closed))

    @classmethod
    def zero(cls, shape: tuple[int, ...], voxel_size: float, closed: Iterable[Side] = ()) -> Self:
        """The field that is zero on a box of `shape` voxels."""
        x, y, z = (np.zeros(n, np.float32) for n in face_shapes(shape))
        return cls((x, y, z), voxel_size, tuple(closed))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along x, y and z."""
        ny, nz = self.faces[0].shape[1:]
        return self.faces[1].shape[0], ny, nz

    @property
    def walls(self) -> list[bool]:
        """One flag for each of `SIDES`: whether it is closed."""
        return [side in self.closed for side in SIDES]

    def centres(self) -> Array:
        """The vectors at voxel centers, shape (nx, ny, nz, 3): the mean of opposite faces."""
        return np.stack(at_centres(self.faces), -1)

    def with_faces(self, faces: Iterable[Array]) -> Self:
        """Other values on the same grid."""
        x, y, z = faces
        return replace(self, faces=(x, y, z))


@dataclass(frozen=True, eq=False)
class Velocity(StaggeredGrid):
    """A velocity in m/s on the faces of voxels, with what is known of its estimate.

    It belongs to the point of arrival: what is at x after a time step dt came from x - u(x) dt.

    Attributes
    ----------
    faces, voxel_size, closed
        See `StaggeredGrid`; the voxel size is in meters.
    figures
        How it was found, if it was estimated: see `smokelift.velocity.estimate_velocity`.

    Raises
    ------
    ValueError
        If the shapes do not belong together, a value is not finite, the voxel size is not positive or a side is
        unknown.
    """

    figures: Mapping[str, float] = field(default_factory=dict, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(map(finite, self.faces)):
            raise ValueError("the velocity holds values that are not finite; set them to 0.")

    def displacement(self, dt: float) -> StaggeredGrid:
        """The way that smoke goes in `dt` seconds, in voxels, on a grid of unit voxels.

        Raises
        ------
        ValueError
            If `dt` is not positive, or the way is longer than `LARGEST` voxels.
        """
        require_positive("dt", dt)
        with np.errstate(over="ignore", invalid="ignore"):
            x, y, z = (component * np.float32(dt / self.voxel_size) for component in self.faces)
        if not all(component.min() >= -LARGEST and component.max() <= LARGEST for component in (x, y, z)):
            raise ValueError(
                f"the velocity moves smoke by more than {LARGEST:g} voxels in {dt:g} s; take a shorter step."
            )
        return StaggeredGrid((x, y, z), 1.0, self.closed)


def finite(values: Array) -> bool:
    """Whether all values are finite. Their sum says so at once, unless it is too large itself."""
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(values.sum())) or bool(np.isfinite(values).all())


def face_shapes(shape: tuple[int, ...]) -> tuple[tuple[int, int, int], ...]:
    """Shapes of the three arrays of face values of a box of `shape` voxels."""
    counts = tuple(shape) if isinstance(shape, Iterable) else ()
    if len(counts) != 3 or not all(isinstance(count, int | np.integer) and count >= 1 for count in counts):
        raise ValueError(f"A box has three whole numbers of voxels, each at least 1, not {shown(shape)}.")
    nx, ny, nz = counts
    return (nx + 1, ny, nz), (nx, ny + 1, nz), (nx, ny, nz + 1)


def halved(shape: tuple[int, int, int]) -> tuple[int, int, int]:
    """Voxels of a grid half as fine; an odd last one counts as two."""
    x, y, z = ((count + 1) // 2 for count in shape)
    return x, y, z


def block_means(values: npt.NDArray[Real], size: int) -> npt.NDArray[Real]:
    """Means over blocks of so many values along every axis; what is missing in the last ones is zero."""
    padded = np.pad(values, [(0, -count % size) for count in values.shape])
    split = [n for count in padded.shape for n in (count // size, size)]
    means: npt.NDArray[Real] = padded.reshape(split).mean(tuple(range(1, 2 * values.ndim, 2)))
    return means


def faces_in(faces: Faces, box: tuple[slice, ...]) -> Faces:
    """Views of a field's components on the faces of a box of voxels."""
    x, y, z = (
        component[tuple(slice(side.start, side.stop + (axis == along)) for axis, side in enumerate(box))]
        for along, component in enumerate(faces)
    )
    return x, y, z


def part_of(velocity: Velocity, box: VoxelBox) -> Velocity:
    """A velocity in a box of its voxels; sides that cut the domain are open."""
    ends = [(side.start == 0, side.stop == count) for side, count in zip(box, velocity.shape, strict=True)]
    outer = [end for pair in ends for end in pair]
    closed = tuple(side for side, wall, shared in zip(SIDES, velocity.walls, outer, strict=True) if wall and shared)
    return Velocity(faces_in(velocity.faces, box), velocity.voxel_size, closed, figures=velocity.figures)


def at_centres(faces: Faces) -> Faces:
    """The three components of a field on faces at voxel centers: the mean of opposite faces."""
    x, y, z = faces
    half = np.float32(0.5)
    return half * (x[1:] + x[:-1]), half * (y[:, 1:] + y[:, :-1]), half * (z[:, :, 1:] + z[:, :, :-1])


def on_faces(centers: Array) -> Faces:
    """Vectors at voxel centers, shape (nx, ny, nz, 3), on faces: the mean of both sides, on the box's sides the one."""
    x, y, z = (
        np.pad(centers[..., axis], [(1, 1) if d == axis else (0, 0) for d in range(3)], mode="edge")
        for axis in range(3)
    )
    return at_centres((x, y, z))


def require_positive(name: str, value: float) -> None:
    """Refuse what is not positive, or beyond what a scene may hold."""
    try:
        fits = bool(SMALLEST <= value <= LARGEST)
    except (TypeError, ValueError):  # no number, or several
        fits = False
    if not fits:
        raise ValueError(f"{name} must be positive and finite, from {SMALLEST:g} to {LARGEST:g}, not {shown(value)}.")


def require_same_shape(what: str, shape: tuple[int, ...], expected: tuple[int, ...]) -> None:
    """Refuse an array that does not fit the box."""
    if tuple(shape) != tuple(expected):
        raise ValueError(f"{what} has shape {tuple(shape)}, but the box has {tuple(expected)} voxels; resample it.")
