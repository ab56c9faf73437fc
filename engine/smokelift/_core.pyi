"""Transport and velocity of smoke on a box of unit cells, compiled from ``cpp/``.

Arrays are float32, C-contiguous, ``[x, y, z]``; others are converted. Velocities are displacements in cells
per frame on the faces of the cells. ``closed`` says which sides are walls, in the order x-, x+, y-, y+, z-, z+.
``threads`` = 0 takes all cores; results do not depend on it.
"""

from typing import TypedDict

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float32]
Arrays = tuple[Array, Array, Array] | list[Array]
Closed = tuple[bool, bool, bool, bool, bool, bool] | list[bool]

class Figures(TypedDict):
    iterations: int
    products: int
    projections: int
    residual: float

def solve_poisson(f: Array, closed: Closed, threads: int = 0) -> Array: ...
def project(faces: Arrays, closed: Closed, passes: int = 2, threads: int = 0) -> tuple[list[Array], float]: ...
def divergence(faces: Arrays, threads: int = 0) -> Array: ...
def gradient(cells: Array, threads: int = 0) -> list[Array]: ...
def advect_cells(
    field: Array, displacement: Arrays, maccormack: bool, extend: bool = False, threads: int = 0
) -> Array: ...
def advect_faces(field: Arrays, displacement: Arrays, maccormack: bool, threads: int = 0) -> list[Array]: ...
def blur(cells: Array, width: float, truncate: float, threads: int = 0) -> Array:
    """A Gaussian of a standard deviation in cells, cut off at `truncate` of them; ends mirrored."""

def linearise(
    before: Array, after: Array, u: Arrays, threshold: float, threads: int = 0
) -> tuple[list[Array], Array, Array, Array, Array, npt.NDArray[np.bool_], float]:
    """Direction, offset, residual, carried, density, smoke and scale; a scale of zero leaves the others undefined."""

def evidence(
    direction: Arrays, offset: Array, weight: Array, smoke: npt.NDArray[np.bool_], u: Arrays, threads: int = 0
) -> tuple[float, float, float]:
    """Sums of weight offset^2, of weight (offset + direction . u)^2, and of weight inside the smoke."""

def directional(direction: Arrays, u: Arrays, threads: int = 0) -> Array: ...
def weighted_products(columns: list[Array], weight: Array, threads: int = 0) -> npt.NDArray[np.float64]: ...
def pushed(
    density: Array, push: npt.ArrayLike, trust: float, prediction: Arrays | None, closed: Closed, threads: int = 0
) -> list[Array]:
    """trust prediction + P(density push); a row of `push` for the constant, or four with slopes along x, y, z."""

def refine(u: Arrays, shape: tuple[int, ...], closed: Closed, threads: int = 0) -> list[Array]: ...
def within_reach(solution: Arrays, u: Arrays, reach: float, closed: Closed, threads: int = 0) -> list[Array]: ...

class LeastSquares:
    def __init__(
        self,
        *,
        direction: Arrays,
        offset: Array,
        weight: Array,
        irrotational: Array,
        centre: Arrays,
        first_order: float,
        second_order: float,
        kinetic: float,
        closed: Closed,
    ) -> None: ...
    def apply(self, u: Arrays, threads: int = 0) -> list[Array]: ...
    def right_hand_side(self, threads: int = 0) -> list[Array]: ...
    def projected_cg(
        self, start: Arrays, *, tolerance: float, limit: int, threads: int = 0
    ) -> tuple[list[Array], Figures]: ...
    def primal_dual(
        self,
        start: Arrays,
        *,
        sigma: float,
        tau: float,
        theta: float,
        absolute: float,
        relative: float,
        limit: int,
        inner_tolerance: float,
        inner_limit: int,
        threads: int = 0,
    ) -> tuple[list[Array], Figures]: ...

Volume = npt.NDArray[np.float32]

def zeros(shape: tuple[int, ...]) -> Array: ...

class Support:
    """Where there can be smoke; ``marked`` is (nx, ny, nz)."""

    def __init__(self, marked: npt.NDArray[np.uint8]) -> None: ...

class Phase:
    def __init__(self, *, to_eye: npt.ArrayLike, albedo: float, anisotropy: float) -> None: ...

class ParallelLight:
    def __init__(
        self,
        *,
        direction: npt.ArrayLike,
        energy: npt.ArrayLike,
        axis: int,
        travel: int,
        first: int,
        slope: tuple[float, float],
        step: float,
    ) -> None: ...

class Face:
    def __init__(
        self,
        *,
        axis: int,
        travel: int,
        first: int,
        planes: int,
        far: float,
        columns_b: tuple[int, int],
        columns_c: tuple[int, int],
    ) -> None: ...

class PointLight:
    def __init__(
        self, *, position: npt.ArrayLike, energy: npt.ArrayLike, voxel_size: float, faces: list[Face]
    ) -> None: ...

Lights = list[ParallelLight | PointLight]

class Rays:
    """One ray a pixel; see `smokelift.render.camera_rays.Rays` for the arrays."""

    def __init__(self, lines: Array, length: Array, planes: npt.NDArray[np.int32]) -> None: ...
    def clip(self, support: Support, medium: Volume, threads: int = 0) -> None: ...
    @property
    def samples(self) -> int: ...

def pack(
    density: Array, corner: tuple[int, int, int], support: Support, extinction: float, medium: Volume, threads: int = 0
) -> None: ...
def unpack(
    gradient: Volume,
    support: Support,
    extinction: float,
    result: Array,
    corner: tuple[int, int, int],
    threads: int = 0,
) -> None: ...
def shade(medium: Volume, support: Support, phase: Phase, lights: Lights, threads: int = 0) -> None: ...
def shade_adjoint(
    medium: Volume,
    gradient: Volume,
    scratch: Volume,
    support: Support,
    phase: Phase,
    lights: Lights,
    threads: int = 0,
) -> None: ...
def march(
    medium: Volume,
    support: Support,
    rays: Rays,
    scattered: Array,
    depth: Array,
    record: Volume | None,
    threads: int = 0,
) -> None: ...
def march_adjoint(
    rays: Rays,
    depth: Array,
    of_scattered: Array,
    of_transmittance: Array,
    record: Volume | None,
    gradient: Volume,
    support: Support,
    threads: int = 0,
) -> None: ...
