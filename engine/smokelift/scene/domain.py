"""The box that holds the smoke: its voxels, its walls and the places where smoke enters."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from smokelift.checks import Doubles, Mask, one_of
from smokelift.scene.checks import SceneError, Vector, integer, items, positive, set_fields, unexpected, vector

Side = Literal["x-", "x+", "y-", "y+", "z-", "z+"]
SIDES: tuple[Side, ...] = ("x-", "x+", "y-", "y+", "z-", "z+")

LATERAL = ((1, 2), (0, 2), (0, 1))
"""The two other axes of each axis (by definition)."""

MAX_SIDE_VOXELS = 4096
"""Voxels along a side of a box, at most: 32 bits know a place along a longer side too roughly."""


@dataclass(frozen=True)
class Box:
    """A box in meters; as the domain of a `Scene` it leaves the resolution to the quality.

    Attributes
    ----------
    min, max
        Corners in meters.

    Raises
    ------
    SceneError
        If the box is empty.
    """

    min: Vector
    max: Vector

    def __post_init__(self) -> None:
        set_fields(self, min=vector(self.min, "min"), max=vector(self.max, "max"))
        for axis, low, high in zip("xyz", self.min, self.max, strict=True):
            if not low < high:
                raise SceneError(
                    f"max must be above min on every axis; along {axis} min is {low:g} and max {high:g}",
                    key="max",
                )

    @property
    def size(self) -> Vector:
        """Lengths of its sides (m)."""
        x, y, z = (high - low for low, high in zip(self.min, self.max, strict=True))
        return x, y, z

    @property
    def centre(self) -> Vector:
        """Middle of the box in meters."""
        x, y, z = ((low + high) / 2 for low, high in zip(self.min, self.max, strict=True))
        return x, y, z

    def contains(self, point: Vector) -> bool:
        """Return whether a point lies inside the box or on its surface."""
        return all(low <= p <= high for low, p, high in zip(self.min, point, self.max, strict=True))

    def corners(self) -> Doubles:
        """Return the eight corners in meters, shape (8, 3)."""
        axes = np.meshgrid(*zip(self.min, self.max, strict=True), indexing="ij")
        return np.asarray(np.stack(axes, axis=-1).reshape(8, 3))


@dataclass(frozen=True)
class Domain(Box):
    """The box that holds the smoke; voxels are cubes.

    Attributes
    ----------
    min, max
        Corners in meters.
    resolution
        Voxels along x, y, z.

    Raises
    ------
    SceneError
        If the box is empty, or its voxels are not cubes to 0.1 %, too many, too large or too small.

    Examples
    --------
    >>> from smokelift import Domain
    >>> Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96)).voxel_size
    0.03125
    """

    resolution: tuple[int, int, int]

    def __post_init__(self) -> None:
        super().__post_init__()
        key, expected = "resolution", f"three whole numbers [nx, ny, nz], all at least 1 and at most {MAX_SIDE_VOXELS}"
        counts = tuple(integer(v, key, expected, 1, MAX_SIDE_VOXELS) for v in items(self.resolution, 3, key, expected))
        set_fields(self, resolution=counts)
        edges = [(high - low) / n for low, high, n in zip(self.min, self.max, counts, strict=True)]
        if max(edges) > 1.001 * min(edges):
            raise SceneError(
                "resolution must make cubic voxels; they would be "
                + " x ".join(f"{edge:.6g}" for edge in edges)
                + " m",
                key="resolution",
            )
        if not 1e-6 <= self.voxel_size <= 1e6:
            raise SceneError(f"voxels must be from 1e-6 to 1e6 m wide; they would be {self.voxel_size:g} m", key="max")

    @property
    def voxel_size(self) -> float:
        """Voxel edge in meters."""
        return (self.max[0] - self.min[0]) / self.resolution[0]

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of an array of voxels, the same as ``resolution``."""
        return self.resolution

    def about_center(self, resolution: tuple[int, int, int], voxel_size: float) -> "Domain":
        """Return the domain about the same center with other voxels, whose size is in meters."""
        (x, y, z), (a, b, c) = self.centre, (n * voxel_size / 2 for n in resolution)
        return Domain((x - a, y - b, z - c), (x + a, y + b, z + c), resolution)

    def with_at_most(self, longest: int) -> "Domain":
        """Return the box, or a little less of it, with larger voxels: so many along its longest side at most."""
        # nor so large that a side has less than one; never beyond the box, where a light may stand
        times = min(max(self.resolution) / longest, min(self.resolution))
        if times <= 1:
            return self
        x, y, z = (max(1, math.floor(n / times + 1e-6)) for n in self.resolution)
        return self.about_center((x, y, z), times * self.voxel_size)

    def grown(self, below: tuple[int, ...], above: tuple[int, ...]) -> "Domain":
        """Return the domain with so many voxels more on its low sides and on its high sides, along x, y and z."""
        h = self.voxel_size
        a, b, c = (low - n * h for low, n in zip(self.min, below, strict=True))
        d, e, f = (high + n * h for high, n in zip(self.max, above, strict=True))
        x, y, z = (n + i + j for n, i, j in zip(self.resolution, below, above, strict=True))
        return Domain((a, b, c), (d, e, f), (x, y, z))

    def first_in(self, other: Box) -> tuple[int, int, int]:
        """Return the voxel, counted from the low corner of another box, at which the domain begins."""
        x, y, z = (round((low - start) / self.voxel_size) for low, start in zip(self.min, other.min, strict=True))
        return x, y, z

    def slices_in(self, other: Box) -> tuple[slice, slice, slice]:
        """Return the part of a larger box's voxels that are the domain's."""
        starts = self.first_in(other)
        x, y, z = (slice(first, first + n) for first, n in zip(starts, self.resolution, strict=True))
        return x, y, z

    def coarser(self, times: int) -> "Domain":
        """The box with voxels so many times as wide; where they do not divide it evenly, it is larger."""
        x, y, z = (-(-count // times) for count in self.resolution)
        edge = times * self.voxel_size
        a, b, c = (low + count * edge for low, count in zip(self.min, (x, y, z), strict=True))
        return Domain(self.min, (a, b, c), (x, y, z))

    def part(self, voxels: tuple[slice, ...]) -> "Domain":
        """The box of some of the voxels."""
        h = self.voxel_size
        a, b, c = (low + h * span.start for low, span in zip(self.min, voxels, strict=True))
        d, e, f = (low + h * span.stop for low, span in zip(self.min, voxels, strict=True))
        x, y, z = (span.stop - span.start for span in voxels)
        return Domain((a, b, c), (d, e, f), (x, y, z))

    def offsets(self, point: Vector) -> tuple[Doubles, Doubles, Doubles]:
        """Return the meters from a point to the voxels' centers along x, y and z, ready to be broadcast."""
        places = zip(self.min, point, self.resolution, strict=True)
        x, y, z = np.ix_(*(low + (np.arange(n) + 0.5) * self.voxel_size - at for low, at, n in places))
        return x, y, z


@dataclass(frozen=True)
class Inlet:
    """A place where smoke enters: a ball.

    Attributes
    ----------
    centre
        In meters.
    radius
        In meters, above 0.
    """

    centre: Vector
    radius: float

    def __post_init__(self) -> None:
        radius = positive(self.radius, "radius", "a number of meters above 0")
        set_fields(self, centre=vector(self.centre, "centre"), radius=radius)

    def reaches(self, domain: Box) -> bool:
        """Return whether a part of it lies in a box."""
        nearest = np.clip(self.centre, domain.min, domain.max)
        return math.dist(self.centre, nearest) <= self.radius

    def voxels(self, domain: Domain) -> Mask:
        """Return the voxels whose centers lie in it, or the nearest ones if none does, shape (nx, ny, nz) bool."""
        x, y, z = domain.offsets(self.centre)
        squares = x**2 + y**2 + z**2
        return np.asarray(squares <= max(self.radius**2, squares.min()))


def checked_sides(value: Any) -> tuple[Side, ...]:
    """Check the names of walls and put them in order."""
    given = list(value) if isinstance(value, tuple) else value
    if not isinstance(given, list) or any(name not in SIDES for name in given):
        raise unexpected(given, "closed", f"a list of sides of the box, of {one_of(SIDES)}", "domain")
    return tuple(side for side in SIDES if side in given)


def open_sides(closed: Iterable[Side]) -> Iterator[tuple[Side, int, bool]]:
    """The sides that are no walls, each with its axis and whether it is a high one."""
    for number, side in enumerate(SIDES):
        if side not in closed:
            yield side, number // 2, number % 2 == 1


def box_around(voxels: Mask, margin: int) -> tuple[slice, slice, slice]:
    """The smallest box that holds the marked voxels and so many more on each side; an empty one without any."""
    along_x = voxels.any((1, 2))
    # rows of memory are read one after the other, and only where there is something
    across = voxels[_span(along_x, 0)].any(0)
    x, y, z = (_span(marked, margin) for marked in (along_x, across.any(1), across.any(0)))
    return x, y, z


def _span(marked: Mask, margin: int) -> slice:
    """Return the slice from the first to the last mark of a row, and so many more at both ends; empty without any."""
    places = np.flatnonzero(marked)
    if not places.size:
        return slice(0, 0)
    return slice(max(int(places[0]) - margin, 0), min(int(places[-1]) + 1 + margin, marked.size))
