"""What stays the same from picture to picture: a camera's rays and the lights, in coordinates of the voxels rendered.

Every ray is sampled where it crosses the planes of voxel centers of its own dominant axis, so a sample needs a
bilinear look-up in one plane, and the position in the plane is linear in the plane's number:

    position_b(k) = start_b + slope_b k,   |slope_b| <= 1.

The distance between samples is between one voxel edge and sqrt(3) of it.

Lights are sweeps from plane to plane of voxels. Columns of light run through the planes and keep the optical depth up
to each. Parallel light has columns of one slope, a voxel apart; those of a point diverge, through the sides of a cube
around it. The adjoint of parallel light is the sweep of the light that travels the other way.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Array, Doubles
from smokelift.scene import Camera, DirectionalLight, Domain, FiniteLight, Medium, PointLight
from smokelift.scene.camera import world_to_pixel
from smokelift.scene.checks import Vector
from smokelift.scene.domain import LATERAL

Voxel = tuple[int, int, int]
Shape = tuple[int, int, int]

INSIDE = 1e-3
"""The footprint is open, so places are kept so many voxels inside: floats then round to the same cell everywhere."""

MIN_SLOPE = 1e-9
"""Voxels per plane. Rays of less slope stay in one column of voxels, and dividing by this loses nothing."""

BAND = 1 << 14
"""Pixels whose rays are found together, about: what lies between fits into a cache."""

DARKEST = 1e-18
"""Energy of a light (W/m^2 or W/sr) that smoke scatters, at least: squares of less vanish in 32 bits."""

CLOSEST = 1e-3
"""Voxels between a point light and a plane, below which the plane is skipped: no voxel there belongs to its axis."""


@dataclass(frozen=True, eq=False)
class Rays:
    """One ray per pixel, for one grid."""

    lines: Array
    """(rows, columns, 4) float32: start_b, slope_b, start_c, slope_c in voxel units, voxel centers at integers."""
    length: Array
    """(rows, columns) float32: distance between samples, m."""
    planes: NDArray[np.int32]
    """(rows, columns, 4) int32: dominant axis; +1 or -1, the direction of travel along it; first and last plane in
    ascending order (last < first: the ray misses the grid)."""
    to_pixel: Doubles
    """(3, 4) float64: homogeneous map from grid coordinates to pixel x, pixel y (both times depth), depth. Depth is 1
    for an orthographic camera."""

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """The dominant axes that occur."""
        return tuple(int(axis) for axis in np.unique(self.planes[self.planes[..., 2] <= self.planes[..., 3], 0]))


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


@dataclass(frozen=True, eq=False)
class RenderPlan:
    """One camera before one grid: the box around the voxels that may hold smoke."""

    domain: Domain
    """The whole domain."""
    corner: Voxel
    """First voxel of the box."""
    marked: NDArray[np.uint8]
    """(x, y, z) uint8: the voxels of the box that may hold smoke."""
    medium: Medium
    """Extinction, albedo, anisotropy."""
    rays: Rays
    """Of the camera, through the box."""
    to_eye: Doubles
    """(3, 4): affine map from a voxel's index in the box to the direction from there to the eye, of any length."""
    lights: tuple[Sweep, ...]
    """In coordinates of the box, in the smoke's color."""
    color: Doubles
    """(channels, 3): color of the radiance in each channel. Without channels the smoke only absorbs."""
    shadows: bool
    """Whether light is attenuated on its way to the voxels."""
    diffuse: bool
    """Whether scattered light is scattered again."""

    @property
    def shape(self) -> Shape:
        """Voxels of the box."""
        x, y, z = self.marked.shape
        return x, y, z

    @property
    def channels(self) -> int:
        """How many channels of in-scattered radiance there are: 0, 1 or 3."""
        return len(self.color)

    @property
    def box(self) -> tuple[slice, slice, slice]:
        """Where the box lies in the domain."""
        x, y, z = (slice(first, first + count) for first, count in zip(self.corner, self.shape, strict=True))
        return x, y, z


@lru_cache(maxsize=32)
def camera_rays(camera: Camera, domain: Domain) -> Rays:
    """The rays of all pixels of a camera through a domain's grid."""
    width, height = camera.size
    across = (np.arange(width) + 0.5 - camera.cx) / camera.fx
    up = -(np.arange(height) + 0.5 - camera.cy) / camera.fy
    h = domain.voxel_size
    bands = np.array_split(up, math.ceil(width * height / BAND))
    found = [_band(camera, domain, across, band) for band in bands]
    lines, length, planes = (np.concatenate(parts) for parts in zip(*found, strict=True))
    to_grid = np.eye(4)
    to_grid[:3, :3] *= h
    to_grid[:3, 3] = np.array(domain.min) + 0.5 * h
    return Rays(lines, length * np.float32(h), planes, world_to_pixel(camera) @ to_grid)


def _band(camera: Camera, domain: Domain, across: Doubles, up: Doubles) -> tuple[Array, Array, NDArray[np.int32]]:
    """Lines, lengths in voxels and planes of the rays of some rows, by the places of columns and rows in the picture.

    Samples lie where the bilinear footprint meets the grid, and before the eye unless the camera is far away.
    """
    right, above, back, eye = np.array(camera.matrix, np.float64)[:3].T
    h, far = domain.voxel_size, camera.type == "orthographic"
    start, direction = (eye - np.array(domain.min)) / h - 0.5, -back
    shift = across[:, None] * right + up[:, None, None] * above
    start, direction = np.broadcast_arrays(*((start + shift / h, direction) if far else (start, direction + shift)))
    axis = np.argmax(np.abs(direction), axis=-1)
    order = np.array([(along, *LATERAL[along]) for along in range(3)])[axis]  # the dominant axis and the two others
    start, direction = (np.take_along_axis(vectors, order, -1) for vectors in (start, direction))
    count = np.array(domain.resolution)[order]
    along = direction[..., 0]
    lines, first, last = [], np.zeros(along.shape), count[..., 0] - 1.0
    for lateral in (1, 2):
        slope = direction[..., lateral] / along
        offset = start[..., lateral] - slope * start[..., 0]
        steep = np.where(np.abs(slope) < MIN_SLOPE, MIN_SLOPE, slope)
        ends = (INSIDE - 1 - offset) / steep, (count[..., lateral] - INSIDE - offset) / steep
        first, last = np.maximum(first, np.minimum(*ends)), np.minimum(last, np.maximum(*ends))
        lines += [offset, slope]
    first, last = np.ceil(first), np.floor(last)
    if not far:  # nothing behind the eye
        first = np.where(along > 0, np.maximum(first, np.floor(start[..., 0]) + 1), first)
        last = np.where(along < 0, np.minimum(last, np.ceil(start[..., 0]) - 1), last)
    hits = first <= last
    # a ray that misses can pass at any distance
    crossings = np.where(hits[..., None], np.stack(lines, -1), 0)
    length = np.linalg.norm(direction, axis=-1) / np.abs(along)
    planes = [axis, np.where(along > 0, 1, -1), np.where(hits, first, 0), np.where(hits, last, -1)]
    return crossings.astype(np.float32), length.astype(np.float32), np.stack(planes, -1).astype(np.int32)


def to_eye(camera: Camera, domain: Domain) -> Doubles:
    """Return the affine map `RenderPlan.to_eye` for the voxels of a domain."""
    matrix = np.array(camera.matrix, np.float64)
    affine = np.zeros((3, 4))
    if camera.type == "orthographic":
        affine[:, 3] = matrix[:3, 2]
        return affine
    h = domain.voxel_size
    affine[:, :3] = -h * np.eye(3)
    affine[:, 3] = matrix[:3, 3] - (np.array(domain.min) + 0.5 * h)
    return affine


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
