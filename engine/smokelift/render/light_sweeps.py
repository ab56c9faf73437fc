"""A scene's lights in the coordinates of a grid, each as sweeps from plane to plane of voxels.

Columns of light run through the planes and keep the optical depth up to each. Parallel light has columns of one slope,
a voxel apart; those of a point diverge, through the sides of a cube around it. The adjoint of parallel light is the
sweep of the light that travels the other way.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smokelift.checks import Doubles
from smokelift.scene import DirectionalLight, Domain, FiniteLight, PointLight
from smokelift.scene.checks import Vector
from smokelift.scene.domain import LATERAL

Voxel = tuple[int, int, int]
Shape = tuple[int, int, int]

DARKEST = 1e-18
"""Energy of a light (W/m^2 or W/sr) that smoke scatters, at least: squares of less vanish in 32 bits."""

CLOSEST = 1e-3
"""Voxels between a point light and a plane, below which the plane is skipped: no voxel there belongs to its axis."""


@dataclass(frozen=True, eq=False)
class ParallelSweep:
    """Parallel light, swept from plane to plane across the dominant axis of its direction."""

    direction: Doubles
    """(3,): direction of travel, unit length."""
    energy: Doubles
    """(channels,): irradiance, W/m^2."""
    axis: int
    travel: int
    """Dominant axis, and +1 or -1 along it."""
    first: int
    """Number of the box's first plane: its columns are those of the whole domain."""
    slope: tuple[float, float]
    """Lateral shift a plane along the two other axes, in voxels, -1 to 1."""
    step: float
    """Length of a ray between two planes, m."""


@dataclass(frozen=True)
class Face:
    """A side of the cube around a point light, and the grid's planes in front of it.

    From the light go columns with slopes p / far, q / far: in the plane at the distance ``far`` they are one voxel
    apart, nearer to the light they are closer together.
    """

    axis: int
    travel: int
    """The planes lie across this axis; +1 or -1 along it leads away from the light."""
    first: int
    planes: int
    """The nearest plane, and how many there are."""
    far: float
    """Distance of the whole domain's farthest plane, in voxels."""
    columns_b: tuple[int, int]
    columns_c: tuple[int, int]
    """First column that meets the grid and their number, along the two other axes."""


@dataclass(frozen=True, eq=False)
class PointSweep:
    """Light from a point."""

    position: Doubles
    """(3,): in the box's grid coordinates: voxel centers at integers."""
    energy: Doubles
    """(channels,): intensity over the voxel edge squared, W/m^2: the irradiance one voxel away."""
    voxel_size: float
    """Edge of a voxel, m."""
    faces: tuple[Face, ...]
    """Those through which voxels are seen. A voxel belongs to the axis along which it is farthest from the light, the
    first such axis if there are several."""


Sweep = ParallelSweep | PointSweep


def light_sweeps(
    lights: Sequence[FiniteLight],
    domain: Domain,
    corner: Voxel,
    shape: Shape,
    scattered: Vector = (1.0, 1.0, 1.0),
    split: bool = False,
) -> tuple[tuple[Sweep, ...], Doubles]:
    """Lights over a box of a domain's voxels, by its first voxel and its size, and the colors (channels, 3).

    Light of one color needs one channel, other light three; lights without energy are left out. The lights' energy is
    multiplied by a fraction of red, green and blue, the color of the smoke. With `split` each color has a channel of
    its own, although one may do. A point light inside the domain or too far away raises a SceneError.
    """
    bright = [light for light in lights if (np.array(_color(light)) * scattered).max() >= DARKEST]
    if not bright:
        return (), np.zeros((0, 3))
    colors = np.array([_color(light) for light in bright], np.float64) * scattered
    color, energies = (np.eye(3), colors) if split else _channels(colors)
    sweeps = [
        _point(light, energy, domain, corner, shape)
        if isinstance(light, PointLight)
        else _parallel(light, energy, domain, corner)
        for light, energy in zip(bright, energies, strict=True)
    ]
    return tuple(sweeps), color


def _color(light: FiniteLight) -> tuple[float, float, float]:
    return light.irradiance if isinstance(light, DirectionalLight) else light.intensity


def _channels(colors: Doubles) -> tuple[Doubles, Doubles]:
    """Split colors (lights, 3) into energies (lights, channels) and the channels' colors (channels, 3)."""
    first = colors[0]
    energies = colors @ first / (first @ first)
    if np.allclose(colors, energies[:, None] * first, rtol=1e-6, atol=0):
        return first[None], energies[:, None]
    return np.eye(3), colors


def _parallel(light: DirectionalLight, energy: Doubles, domain: Domain, corner: Voxel) -> ParallelSweep:
    direction = np.array(light.direction, np.float64)
    direction /= np.linalg.norm(direction)
    axis = int(np.argmax(np.abs(direction)))
    along = float(direction[axis])
    b, c = LATERAL[axis]
    return ParallelSweep(
        direction=direction,
        energy=energy,
        axis=axis,
        travel=1 if along > 0 else -1,
        first=corner[axis],
        slope=(float(direction[b]) / along, float(direction[c]) / along),
        step=domain.voxel_size / abs(along),
    )


def _point(light: PointLight, energy: Doubles, domain: Domain, corner: Voxel, shape: Shape) -> PointSweep:
    light.require_place(domain)
    h = domain.voxel_size
    position = (np.array(light.position) - np.array(domain.min)) / h - 0.5 - np.array(corner)
    faces = []
    for axis in range(3):
        first, last = -corner[axis], domain.resolution[axis] - 1 - corner[axis]
        for travel, farthest in ((-1, first), (1, last)):
            face = _face(position, shape, axis, travel, travel * (farthest - float(position[axis])))
            if face:
                faces.append(face)
    return PointSweep(position, energy / h**2, h, tuple(faces))


def _face(light: Doubles, shape: Shape, axis: int, travel: int, far: float) -> Face | None:
    at = float(light[axis])
    if travel > 0:
        first, last = max(0, math.ceil(at + CLOSEST)), shape[axis] - 1
    else:
        first, last = min(shape[axis] - 1, math.floor(at - CLOSEST)), 0
    planes = travel * (last - first) + 1
    if planes <= 0:
        return None
    near, deepest = travel * (first - at), travel * (last - at)
    columns = []
    for lateral in LATERAL[axis]:
        low, high = -1 - float(light[lateral]), shape[lateral] - float(light[lateral])
        if low >= deepest or high <= -deepest:
            return None  # every voxel is farther off this axis than along it
        most = math.ceil(far) + 1
        begin = max(math.floor(min(low / near, low / deepest) * far), -most)
        end = min(math.ceil(max(high / near, high / deepest) * far), most)
        columns.append((begin, end - begin + 1))
    return Face(axis, travel, first, planes, far, columns[0], columns[1])
