"""The exact answer: the renderer's discrete sums and their adjoint in float64.

Rays are sampled where they cross the voxel-center planes of their own dominant axis, bilinearly in the plane, with
kappa zero and J that of the nearest voxel outside the grid. The light's optical depth is S^T K S kappa: S from voxels
to the light's columns (bilinear in each plane), K the midpoint rule along the columns.

All rays advance together, plane after plane, which is fast enough for 256^3 voxels.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.renderer.scene import BenchScene
from smokelift.checks import Doubles
from smokelift.scene.camera import ray_through_pixels


def image_and_gradient(scene: BenchScene) -> tuple[Doubles, Doubles]:
    """Return the image (rows, columns, 3) and the derivative (n, n, n) of the sum of (image - target)^2."""
    h, light = scene.domain.voxel_size, scene.light
    bundles = _bundles(scene)
    inscatter = _inscatter(scene)
    kappa = np.pad(scene.medium.extinction * scene.density.astype(np.float64), 1)
    glow = np.pad(inscatter, 1, mode="edge")
    image = _image(scene, bundles, kappa, glow)
    of_image = 2 * (image - scene.target)
    of_scattered = of_image @ np.array(light.irradiance)
    of_transmittance = of_image @ np.array(scene.background)
    of_kappa, of_glow = np.zeros_like(kappa), np.zeros_like(glow)
    for bundle in bundles:
        _pull_back(bundle, kappa, glow, of_scattered, of_transmittance, of_kappa, of_glow)
    # dJ / d(optical depth to the light) = -J, and the sweep's transpose is the light that travels the other way
    of_depth = -inscatter * _fold(of_glow)
    shadows = light_optical_depth(of_depth, h, -np.array(light.direction))
    return image, scene.medium.extinction * (of_kappa[1:-1, 1:-1, 1:-1] + shadows)


def image(scene: BenchScene) -> Doubles:
    """Return the image (rows, columns, 3) alone."""
    kappa = np.pad(scene.medium.extinction * scene.density.astype(np.float64), 1)
    return _image(scene, _bundles(scene), kappa, np.pad(_inscatter(scene), 1, mode="edge"))


def light_optical_depth(kappa: Doubles, voxel_size: float, direction: Doubles) -> Doubles:
    """Return the optical depth from a parallel light, travelling in a direction (3,), to every voxel."""
    axis = int(np.argmax(np.abs(direction)))
    field = np.moveaxis(kappa, axis, 0)
    slope = np.delete(direction, axis) / direction[axis]
    step = voxel_size * float(np.linalg.norm(direction)) / abs(float(direction[axis]))
    planes, rows, columns = field.shape
    shift = np.floor(np.arange(planes)[:, None] * slope).astype(int)
    weight = np.arange(planes)[:, None] * slope - shift
    window = shift.max(0) - shift  # where a plane's slots begin among the columns
    before = np.zeros((rows + 1 + window[:, 0].max(), columns + 1 + window[:, 1].max()))
    depth = np.empty(field.shape)
    for k in range(planes) if direction[axis] > 0 else range(planes - 1, -1, -1):
        (f, g), (row, column) = weight[k], window[k]
        passing = before[row : row + rows + 1, column : column + columns + 1]
        value = step * _blend(np.pad(field[k], 1), 1 - f, 1 - g)
        depth[k] = _blend(passing + value / 2, f, g)
        passing += value
    return np.moveaxis(depth, 0, axis)


def phase_volume(scene: BenchScene) -> Doubles:
    """Return albedo x Henyey-Greenstein phase function from the light to the camera, 1/sr, at every voxel."""
    h, g = scene.domain.voxel_size, scene.medium.anisotropy
    axes = [low + (np.arange(n) + 0.5) * h for low, n in zip(scene.domain.min, scene.domain.resolution, strict=True)]
    to_eye = [e - a for e, a in zip(scene.camera.position, np.meshgrid(*axes, indexing="ij", sparse=True), strict=True)]
    cosine = sum(t * o for t, o in zip(scene.light.direction, to_eye, strict=True)) / np.sqrt(
        sum(o * o for o in to_eye)
    )
    return np.asarray(scene.medium.albedo * (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5))


def _blend(plane: Doubles, f: float, g: float) -> Doubles:
    """Weigh every 2 x 2 cell of a plane; f and g belong to the lower index."""
    across = f * plane[:-1] + (1 - f) * plane[1:]
    return np.asarray(g * across[:, :-1] + (1 - g) * across[:, 1:])


def _inscatter(scene: BenchScene) -> Doubles:
    """In-scattered radiance J of every voxel for unit irradiance."""
    h, travel = scene.domain.voxel_size, np.array(scene.light.direction)
    depth = light_optical_depth(scene.medium.extinction * scene.density.astype(np.float64), h, travel)
    return np.asarray(phase_volume(scene) * np.exp(-depth))


@dataclass(frozen=True, eq=False)
class _Bundle:
    """The rays of one dominant axis and one direction of travel along it; positions in voxels.

    Position in plane k: base + slope k, (rays, 2); the camera stands at ``eye`` (rays,) along the axis.
    """

    axis: int
    travel: int
    pixels: NDArray[np.bool_]
    base: Doubles
    slope: Doubles
    eye: Doubles
    step: Doubles


def _bundles(scene: BenchScene) -> list[_Bundle]:
    origin, direction = ray_through_pixels(scene.camera)
    h = scene.domain.voxel_size
    start = (origin - np.array(scene.domain.min)) / h - 0.5
    dominant = np.argmax(np.abs(direction), -1)
    bundles = []
    for axis in range(3):
        for travel in (1, -1):
            pixels = (dominant == axis) & (direction[..., axis] * travel > 0)
            along, eye = direction[pixels][:, axis], start[pixels][:, axis]
            slope = np.delete(direction[pixels], axis, -1) / along[:, None]
            base = np.delete(start[pixels], axis, -1) - slope * eye[:, None]
            bundles.append(_Bundle(axis, travel, pixels, base, slope, eye, h / np.abs(along)))
    return bundles


@dataclass(frozen=True, eq=False)
class _Samples:
    """Where rays meet a plane: which rays, their cell in the padded plane, and the weights of its four corners."""

    rays: NDArray[np.intp]
    cell: NDArray[np.intp]
    width: int
    weights: tuple[Doubles, Doubles, Doubles, Doubles]

    def gather(self, plane: Doubles) -> Doubles:
        """Interpolate in a padded plane."""
        flat = plane.ravel()
        corners = zip(self.weights, (0, 1, self.width, self.width + 1), strict=True)
        return np.asarray(sum(w * flat[self.cell + offset] for w, offset in corners))

    def scatter(self, values: Doubles, plane: Doubles) -> None:
        """Add values into a padded plane: the transpose of `gather`."""
        corners = zip(self.weights, (0, 1, self.width, self.width + 1), strict=True)
        for w, offset in corners:
            plane += np.bincount(self.cell + offset, w * values, plane.size).reshape(plane.shape)


def _crossings(bundle: _Bundle, planes: Iterable[int], shape: tuple[int, ...]) -> Iterator[tuple[int, _Samples]]:
    """Planes of a padded grid in an order, with the samples of the rays that meet them before the camera."""
    rows, columns = shape[1], shape[2]
    for k in planes:
        at = bundle.base + bundle.slope * k + 1
        inside = (at > 0).all(-1) & (at < (rows - 1, columns - 1)).all(-1) & ((k - bundle.eye) * bundle.travel > 0)
        rays = np.nonzero(inside)[0]
        cell = np.floor(at[rays]).astype(np.intp)
        f, g = (at[rays] - cell).T
        weights = ((1 - f) * (1 - g), (1 - f) * g, f * (1 - g), f * g)
        yield k, _Samples(rays, cell[:, 0] * columns + cell[:, 1], columns, weights)


def _image(scene: BenchScene, bundles: list[_Bundle], kappa: Doubles, glow: Doubles) -> Doubles:
    width, height = scene.camera.size
    scattered, transmittance = np.zeros((height, width)), np.ones((height, width))
    for bundle in bundles:
        k_field, j_field = np.moveaxis(kappa, bundle.axis, 0), np.moveaxis(glow, bundle.axis, 0)
        radiance, tau = np.zeros_like(bundle.step), np.ones_like(bundle.step)
        planes = range(k_field.shape[0] - 2)
        for k, samples in _crossings(bundle, planes[:: bundle.travel], k_field.shape):
            x = bundle.step[samples.rays] * samples.gather(k_field[k + 1])
            radiance[samples.rays] -= tau[samples.rays] * np.expm1(-x) * samples.gather(j_field[k + 1])
            tau[samples.rays] *= np.exp(-x)
        scattered[bundle.pixels], transmittance[bundle.pixels] = radiance, tau
    return scattered[..., None] * scene.light.irradiance + transmittance[..., None] * scene.background


def _pull_back(
    bundle: _Bundle,
    kappa: Doubles,
    glow: Doubles,
    of_scattered: Doubles,
    of_transmittance: Doubles,
    of_kappa: Doubles,
    of_glow: Doubles,
) -> None:
    """Add derivatives with respect to the padded kappa and J, from those of the two images.

    From back to front: a sample needs the transmittance before it, exp of what is left of the ray's optical depth,
    and the radiance that arrives from behind it (times the loss's derivative).
    """
    k_field, j_field, of_k, of_j = (np.moveaxis(field, bundle.axis, 0) for field in (kappa, glow, of_kappa, of_glow))
    planes = range(k_field.shape[0] - 2)
    before = np.zeros_like(bundle.step)
    for k, samples in _crossings(bundle, planes, k_field.shape):
        before[samples.rays] += bundle.step[samples.rays] * samples.gather(k_field[k + 1])
    weight, behind = of_scattered[bundle.pixels], of_transmittance[bundle.pixels]
    for k, samples in _crossings(bundle, planes[:: -bundle.travel], k_field.shape):
        rays = samples.rays
        x = bundle.step[rays] * samples.gather(k_field[k + 1])
        lit = weight[rays] * samples.gather(j_field[k + 1])
        before[rays] -= x
        tau, opacity = np.exp(-before[rays]), -np.expm1(-x)
        samples.scatter(bundle.step[rays] * tau * (1 - opacity) * (lit - behind[rays]), of_k[k + 1])
        samples.scatter(tau * opacity * weight[rays], of_j[k + 1])
        behind[rays] = opacity * lit + (1 - opacity) * behind[rays]


def _fold(padded: Doubles) -> Doubles:
    """The transpose of padding with the nearest voxel's value."""
    for axis in range(3):
        planes = np.moveaxis(padded, axis, 0)
        planes[1] += planes[0]
        planes[-2] += planes[-1]
    return padded[1:-1, 1:-1, 1:-1]
