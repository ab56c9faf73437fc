"""The scene of the renderer's benchmark: a plume with structure in a given fraction of the voxels, seen obliquely."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.scene import Camera, DirectionalLight, Domain, Medium

PLUME = 0.18
"""Fraction of the voxels with smoke in the first scene."""

OPTICAL_DEPTH = 3.0
"""Largest optical depth along the grid's y axis."""

_BACKGROUND = (0.2, 0.2, 0.2)
_LIGHT = DirectionalLight((0.8, 0.6, -1.0), (3.0, 2.9, 2.8))
"""45 degrees above the horizon, and along no axis of the grid."""


@dataclass(frozen=True, eq=False)
class BenchScene:
    """What a peer renders.

    Attributes
    ----------
    camera, domain, medium, lights
        As in `smokelift.scene.Scene`; every peer renders the first light, a directional one.
    background : (3,)
        Linear radiance behind the smoke.
    density : (n, n, n) float32
        Zero where there is no smoke.
    target : (n, n, 3) float32
        The loss is the sum of (image - target)^2.
    """

    camera: Camera
    domain: Domain
    medium: Medium
    lights: tuple[DirectionalLight, ...]
    background: tuple[float, float, float]
    density: NDArray[np.float32]
    target: NDArray[np.float32]

    @property
    def support(self) -> NDArray[np.bool_] | None:
        """The voxels that may hold smoke, as a visual hull gives them; None if all may."""
        smoke = self.density > 0
        return None if smoke.all() else smoke

    @property
    def light(self) -> DirectionalLight:
        """The light that every peer renders."""
        return self.lights[0]


def plume(size: int, fraction: float) -> NDArray[np.float32]:
    """Return a density (size, size, size) with structure that is above zero in exactly this fraction of the voxels.

    It is a tilted ellipsoid with billows. Its surface is the quantile of the distance from the middle that leaves the
    fraction inside. With fraction 1 there is structure everywhere and no envelope.
    """
    axis = (2 * np.arange(size, dtype=np.float32) + 1) / size - 1
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    structure = 1 + 0.45 * np.sin(9 * x + 1) * np.sin(8 * y) * np.cos(7 * z)
    structure *= 1 + 0.3 * np.sin(23 * x + 2 * y) * np.sin(21 * y + 3 * z) * np.sin(19 * z + 2 * x)
    if fraction >= 1:
        return np.asarray(structure)
    distance = np.sqrt(((x - 0.12 * z) / 0.65) ** 2 + ((y + 0.08 * z) / 0.65) ** 2 + (z / 0.85) ** 2)
    distance *= 1 + 0.08 * np.sin(11 * x + 3 * z) * np.sin(10 * y + 1) * np.sin(9 * z)
    rank = round(fraction * distance.size)
    radius = np.partition(distance, rank, axis=None)[rank]
    return np.asarray(np.maximum(1 - distance / radius, 0) * structure)


def bench_scene(density: NDArray[np.float32], target: NDArray[np.float32], lights: int = 1) -> BenchScene:
    """Put a cube of density before the camera, with the extinction that gives it the benchmark's optical depth.

    A single light comes from 45 degrees above the horizon; several lights are spread over the sky.
    """
    size = density.shape[0]
    return BenchScene(
        camera=Camera.look_at((2.2, -1.6, 1.9), (0.5, 0.5, 0.5), fov_y_degrees=32, size=(size, size)),
        domain=Domain((0, 0, 0), (1, 1, 1), (size, size, size)),
        medium=Medium(extinction=OPTICAL_DEPTH * size / float(density.sum(1).max()), albedo=0.9, anisotropy=0.3),
        lights=(_LIGHT,) if lights == 1 else shining(-spread(lights), _LIGHT.irradiance),
        background=_BACKGROUND,
        density=density,
        target=target,
    )


def shining(directions: NDArray[np.float64], irradiance: tuple[float, float, float]) -> tuple[DirectionalLight, ...]:
    """Return lights that travel in directions (count, 3) and have an irradiance together."""
    r, g, b = (value / len(directions) for value in irradiance)
    return tuple(DirectionalLight((x, y, z), (r, g, b)) for x, y, z in directions.tolist())


def spread(count: int, lowest: float = 0.0) -> NDArray[np.float64]:
    """Return directions (count, 3) towards the sky, spread evenly from the top down to a height of a unit sphere."""
    height = lowest + (1 - lowest) * (np.arange(count) + 0.5) / count
    azimuth = np.pi * (1 + 5**0.5) * np.arange(count)
    level = np.sqrt(1 - height**2)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), height], -1)
