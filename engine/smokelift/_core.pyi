"""Transport, velocity and rendering of smoke on a box of unit cells, compiled from ``cpp/``.

Arrays are float32, C-contiguous, ``[x, y, z]``. What is only read is converted if it is not, what is written is
refused. ``cells`` have the shape (nx, ny, nz). ``faces`` are the normal components on x, y and z faces, arrays
of shape (nx+1, ny, nz), (nx, ny+1, nz) and (nx, ny, nz+1). Velocities are displacements in cells per frame.
``closed`` says which sides of the box are walls, in the order x-, x+, y-, y+, z-, z+.

The renderer's grid has a border of one voxel. A volume is (nx+2, ny+2, nz+2, 1 + channels): by voxel the
extinction in 1/m and the in-scattered radiance of each channel, or derivatives by these. Of its diffuse light
arrays over blocks of voxels are (fields, bx, by, bz). What is linear across a block has four fields: the mean,
and the slopes along x, y and z, which are the differences across a block.

Functions raise ValueError for arrays whose shapes do not belong together.
"""

# Written by tools/stubs.py from the docstrings in cpp/register_*.cpp.

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

from smokelift.checks import Array, Mask
from smokelift.render.plan import ParallelSweep, PointSweep

Reals = npt.NDArray[np.floating[Any]]
Integers = npt.NDArray[np.int32]
Bytes = npt.NDArray[np.uint8]
Faces = tuple[Reals, Reals, Reals] | list[Array]

class Figures(TypedDict):
    """How a minimum was found: steps of the solver, products with the matrix, projections, its last residual."""

    iterations: int
    products: int
    projections: int
    residual: float

def set_threads(count: int) -> None:
    """Set the number of threads of every call from now on; 0, as at first, takes all cores of the process.

    Results do not depend on it.
    """

def solve_poisson(f: Reals, closed: npt.ArrayLike) -> Array:
    """Solve -laplace p = f at cell centers, with p = 0 on open sides and no flux through closed ones.

    With all sides closed the mean of f is removed first, and p is known up to a constant.
    """

def project(faces: Faces, closed: npt.ArrayLike, passes: int = 2) -> tuple[list[Array], float]:
    """The nearest velocity without divergence, and max |div u| / max |u| of that.

    Nearest in the sum of squares over faces, those on open sides counted half. A second pass removes what rounding
    leaves.
    """

def divergence(faces: Faces) -> Array:
    """Net outflow of every cell."""

def advect_cells(field: Reals, displacement: Faces, maccormack: bool, extend: bool = False) -> Array:
    """Values at x - displacement(x), interpolated linearly.

    What comes from outside the box is zero, or with ``extend`` the nearest value inside. The correction (Selle et al.
    2008) is limited to the values around the point of origin.
    """

def advect_faces(field: Faces, displacement: Faces, maccormack: bool) -> list[Array]:
    """The same for a velocity, each component at its own faces; beyond the box it continues as on its side."""

def blur(cells: Reals, width: float, truncate: float) -> Array:
    """A Gaussian of a standard deviation in cells, cut off at ``truncate`` of them; ends are mirrored."""

def prolong(u: Faces) -> list[Array]:
    """A velocity in the cells of a grid that is twice as fine, each with the divergence of its coarse one."""

class LeastSquares:
    """A quadratic function of face velocities, E(u) = u.Au - 2 b.u + constant.

    E sums weight (offset + direction . u)^2 + irrotational |curl u|^2 over the cells, and of v = u - center the terms
    first_order |grad v|^2 + second_order |grad curl v|^2 + kinetic |v|^2.
    """
    def __init__(
        self,
        *,
        direction: Sequence[Reals],
        offset: Reals,
        weight: Reals,
        irrotational: Reals,
        center: Faces,
        first_order: float,
        second_order: float,
        kinetic: float,
        closed: npt.ArrayLike,
    ) -> None: ...
    def apply(self, u: Faces) -> list[Array]:
        """A u."""

    def right_hand_side(self) -> list[Array]:
        """b."""

    def diagonal(self) -> list[Array]:
        """The diagonal of A as it is away from the sides, without what irrotational adds."""

    def projected_cg(self, start: Faces, *, tolerance: float, limit: int) -> tuple[list[Array], Figures]:
        """Minimize over velocities without divergence by preconditioned conjugate gradients among them.

        Parameters
        ----------
        start
            Without divergence.
        tolerance
            Stops at this fraction of the preconditioned gradient at rest.
        limit
            Iterations at most.
        """

def zeros(shape: npt.ArrayLike) -> Array:
    """Zeros that get memory where they are touched, in large pages where the system has them."""

class Support:
    """Where there can be smoke; ``marked`` is (nx, ny, nz), not 0 in such voxels."""
    def __init__(self, marked: Bytes) -> None: ...

def pack(density: Array, support: Support, extinction: float, medium: Array) -> None:
    """Write the extinction of the marked voxels from their density; ``extinction`` is in 1/m at density 1."""

def unpack(gradient: Array, support: Support, extinction: float, result: Array) -> None:
    """Write the derivative by density of the marked voxels into ``result``; others are left as they are."""

class Phase:
    """Henyey-Greenstein phase function times albedo, towards the camera.

    ``to_eye`` is (3, 4): it maps a voxel's index (i, j, k, 1) to the direction to the eye, of any length.
    """
    def __init__(self, *, to_eye: npt.ArrayLike, albedo: float, anisotropy: float) -> None: ...

def shade(medium: Array, support: Support, phase: Phase, lights: Sequence[ParallelSweep | PointSweep]) -> None:
    """Write the radiance that the lights scatter in every voxel towards the camera."""

def shade_adjoint(
    medium: Array,
    gradient: Array,
    scratch: Array | None,
    support: Support,
    phase: Phase,
    lights: Sequence[ParallelSweep | PointSweep],
) -> None:
    """Add to the derivative by extinction what the in-scattered radiance says of it (adjoint sweep of `shade`).

    ``scratch`` is one float per voxel, shape (nx+2, ny+2, nz+2, 1); a single light needs none. The derivative by the
    in-scattered radiance is used up.
    """

class Rays:
    """One ray a pixel.

    Parameters
    ----------
    lines : (rows, columns, 4)
        b0, b1, c0, c1: the ray crosses plane k of its dominant axis at (b0 + b1 k, c0 + c1 k) along the two other axes,
        voxel centers at integers.
    length : (rows, columns)
        Between two planes in meters.
    planes : (rows, columns, 4)
        Dominant axis, travel along it, first and last plane with a sample; last < first where there is none.
    """
    def __init__(self, lines: Reals, length: Reals, planes: Integers) -> None: ...
    def clip(self, support: Support, medium: Array) -> None:
        """Shorten every ray to where the voxels around it hold anything."""

    @property
    def recorded(self) -> int:
        """Samples that a record holds of each channel: neighboring rays have as many."""

def march(medium: Array, support: Support, rays: Rays, record: Array | None) -> tuple[Array, Array]:
    """Radiance towards the camera (rows, columns, channels) and optical depth (rows, columns) of every ray.

    ``record`` (1 + channels, `Rays.recorded`) is written for `march_adjoint`: what the samples held. It may be None.
    """

def march_adjoint(
    rays: Rays,
    depth: Reals,
    scattered_gradient: Reals,
    transmittance_gradient: Reals,
    record: Array | None,
    gradient: Array,
    support: Support,
) -> None:
    """Write the derivatives by the voxels of ``gradient`` from those by radiance and transmittance of every ray.

    ``record`` is that of `march`; it is overwritten.
    """

class Blocks:
    """Cubes of ``size`` voxels; every voxel of a support lies between the centers of eight.

    ``offset`` is the index of the support's first voxel among those of the first block, ``shape`` the number of blocks.
    """
    def __init__(self, *, shape: npt.ArrayLike, size: int, offset: npt.ArrayLike) -> None: ...

def average(medium: Array, support: Support, blocks: Blocks) -> Array:
    """Over blocks (1 + 4 channels, bx, by, bz): the mean of the extinction kappa, then kappa J by channel, linear."""

def average_adjoint(medium: Array, support: Support, blocks: Blocks, means_gradient: Reals, gradient: Array) -> None:
    """Add to the derivatives by kappa and J what those by the result of `average` say of them."""

def add_interpolated(values: Reals, factor: float, blocks: Blocks, medium: Array, support: Support) -> None:
    """J += factor x values (4 channels, bx, by, bz): what eight blocks say, weighted as between their centers."""

def interpolate_adjoint(gradient: Array, support: Support, factor: float, blocks: Blocks) -> Array:
    """Derivative by the values of `add_interpolated` (4 channels, bx, by, bz) from that by J."""

def diffuse(means: Reals, albedo: float, edge: float) -> Array:
    """Mean radiance (4 channels, bx, by, bz) after any number of scatterings, in W/m^2/sr.

    Parameters
    ----------
    means : (1 + 4 channels, bx, by, bz)
        Extinction in 1/m, then what is emitted by channel, in W/m^3/sr, the same in all directions.
    edge
        Of a block in meters.
    """

def diffuse_adjoint(means: Reals, radiance: Reals, radiance_gradient: Reals, albedo: float, edge: float) -> Array:
    """Derivative by the means (1 + 4 channels, bx, by, bz) from that by the radiance of `diffuse`."""

def depth_profile(
    voxels: Mask,
    places: npt.ArrayLike,
    depth: npt.ArrayLike,
    at: Sequence[Reals],
    middle: Reals,
    width: Reals,
    flatness: float,
) -> tuple[Array, Array]:
    """exp(-(|depth - middle| / width)^flatness) and the width, both (n,) at the marked voxels.

    ``places`` are those of the voxels along x, y and z in meters from a center, ``depth`` a direction, ``flatness`` a
    multiple of a half; ``at`` rows and columns (n,) where the pictures ``middle`` and ``width`` are read.
    """

class PictureMap:
    """Where the voxels of a grid lie in a picture.

    ``to_pixel`` (3, 4) maps homogeneous points of the world to (x depth, y depth, depth) in pixels. ``centers`` are the
    voxel centers' world coordinates (m) along x, y and z, ``size`` the picture's columns and rows.
    """
    def __init__(self, to_pixel: Reals, centers: npt.ArrayLike, size: npt.ArrayLike) -> None: ...
    def places(self, voxels: Mask) -> tuple[Array, Array, Mask]:
        """Rows and columns (n,) of the marked voxels, pixel centers at integers; whether they are in the picture."""

    def shown(self, picture: Mask) -> Mask:
        """Voxels in the picture whose nearest pixel is marked (rows, columns)."""

def read_bilinearly(picture: Reals, rows: Reals, columns: Reals) -> Array:
    """A picture (rows, columns) at places (n,) in pixels; the nearest pixel's value outside."""

def means_of_two(values: Array, voxels: Mask | None = None) -> Array:
    """Means of two along every axis; beyond the grid there is nothing, nor in rows without marked voxels."""

def prolong_values(values: Array, voxels: Mask) -> Array:
    """Values of the coarse grid, linear between the voxels' middles, at the marked voxels (n,) of the fine one."""

def scale_alike(values: Array, voxels: Mask, before: Array, after: Array, least: float, result: Array) -> None:
    """Write values x (after / before) at the marked voxels into a result.

    ``before``, at least ``least``, and ``after`` are the coarse grid's, linear between its voxels' middles.
    """

def sum_lines(picture: Bytes, table: Reals, first: Integers, lines: Integers, weights: Reals) -> Array:
    """Weighted sums (n, columns, channels) of lines of a picture (rows, columns, channels) whose values a table tells.

    The ``n``-th is that of ``lines`` from ``first[n]`` to ``first[n + 1]``, as of a sparse matrix in rows, and the same
    to the last bit. ``table`` has 256 values. Pixels lie one after the other in each line.
    """

def sum_columns(values: Reals, first: Integers, columns: Integers, weights: Reals) -> Array:
    """Weighted sums (rows, n, channels) of columns of values (rows, columns, channels), as of `sum_lines`."""

def add_weighted(picture: Bytes, table: Reals, weights: Reals, lines: Integers, columns: Integers, sums: Array) -> None:
    """Add the values of a picture (rows, columns, 3), times weights (m, n, 3) of its parts, to sums of its shape.

    The ``n``-th part down has the lines from ``lines[n]`` to ``lines[n + 1]``; columns likewise. The rest is as of
    `sum_lines`.
    """

def blur_picture(picture: Reals, weights: npt.ArrayLike) -> Array:
    """A picture (rows, columns) or (rows, columns, channels), smoothed down and across.

    ``weights`` are those of a pixel itself and of its neighbors on either side, outwards. Beyond its edges the picture
    is its own mirror image.
    """

def filled_spans(volume: Reals) -> Integers:
    """Of every column of voxels (i, j) the first that is not zero and the end of those that are not, (nx, ny, 2)."""

def project_turned(volume: Reals, spans: Integers, first: float, steps: npt.ArrayLike, columns: int) -> Array:
    """The picture (columns, nz) of a volume that is turned about its last axis, a pixel a voxel.

    It is zero outside the spans; see `filled_spans`.

    The column of voxels (i, j) is centered on first + i steps[0] + j steps[1], in pixels. A pixel gets what it covers
    of the voxels' shadows, so that even smoke makes an even picture from every angle.
    """

def scale_turned(volume: Array, spans: Integers, first: float, steps: npt.ArrayLike, logarithm: Reals) -> None:
    """Multiply a volume in its spans by exponentials of a picture (columns, nz), read as `project_turned` weighs it."""

def unfold(picture: Reals, at: Integers, size: int) -> Array:
    """Pixels (size * size, n) of the square patches about places (2, n), all of which lie in the picture."""

def fold(pixels: Reals, at: Integers, size: int, shape: npt.ArrayLike) -> Array:
    """For each pixel of a picture the mean of what the patches that cover it hold there; 0 where none does."""

def to_quantiles(values: Array, wanted: Reals) -> None:
    """Replace values (lines, n) by their distance to the quantiles of the same rank of a line of ``wanted`` (lines, m).

    These are sorted. The distances are the one-dimensional optimal transport from one distribution to the other.
    """

def pyramid_levels(rows: int, columns: int) -> int:
    """Levels of a pyramid over so many cells; the coarsest has two cells at most along its longer side."""

def extract(
    moments: Reals,
    source: npt.ArrayLike,
    errors: npt.ArrayLike,
    deviations: npt.ArrayLike,
    outlier_freedom: float,
    pixels: float,
    rounds: int,
    iterations: int,
) -> tuple[Array, Array, Array]:
    """Opacity and the fields of J (rows, columns, 4) of smoke before a plate, the deviation of T, the data's weight.

    ``moments`` (rows, columns, 25) are means over each cell's pixels: B, the upper triangle of B B', D and D B', with D
    = I - B; then the variance of a pixel's noise in each channel and the probability that the plate is wrong. Then it
    has a covariance of ``errors``, the upper triangle. ``source`` (3,) is J where its fields are 0, ``deviations`` the
    prior's standard deviations by level, the finest first. ``outlier_freedom`` are the degrees of freedom of the noise,
    0 for normal noise; ``pixels`` are in a cell.
    """

class MarkedVoxels:
    """The marked voxels of a grid; values (count,) are at them in their order in memory."""
    def __init__(self, voxels: Mask) -> None: ...
    @property
    def count(self) -> int:
        """How many there are."""

    def above_zero(self, a: Reals, b: Reals) -> MarkedVoxels:
        """Those of them at which either volume (nx, ny, nz) is above 0."""

    def take(self, volume: Reals, out: Array | None = None) -> Array:
        """Values of a volume, written to ``out`` if that is given."""

    def put(self, values: Reals, volume: Array, factor: float = 1.0) -> None:
        """Write values, times a factor, into a volume."""

    def smooth_in_cubes(self, values: Reals, size: int, weight: float, out: Array) -> None:
        """Write values / (1 + weight) and, ``weight`` times as much, their means over cubes of ``size`` voxels.

        Half of it is over each of two lattices, half a cube apart. The result may replace the values.
        """

    def read_lattice(self, lattice: Reals, scale: float, shift: npt.ArrayLike, motion: Reals, stretch: float) -> Array:
        """A lattice that repeats, read at the voxels (count,), smooth between nodes at whole numbers.

        A voxel lies at its index x scale + shift (3,) + its motion (3, count) x stretch, which is finite.
        """

    def scale_along_rays(
        self,
        picture: PictureMap,
        values: Reals,
        plausible: Reals | None,
        logarithm: Reals,
        floor: float,
        max_gain: float,
        fraction: float,
        out: Array,
    ) -> None:
        """Scale values by a fraction of the logarithmic steps (rows, columns) of their pixels' rays.

        Steps are read bilinearly; what is not in the picture stays as it is. With ``plausible`` (count,) a step that
        would scale a value to v is multiplied by plausible / v where it adds smoke and by v / plausible where it takes
        some, both plus ``floor``, by ``max_gain`` at most. The result may replace the values.
        """
