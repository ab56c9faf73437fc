"""The lights of a scene as points and parallel lights: an environment picture becomes a few, fixed and deterministic.

The picture is cut into strata. A stratum becomes one parallel light: its irradiance is the integral of radiance over
the stratum's solid angle, so that the sum over the lights is exact for any number of them, and it comes from the
stratum's centroid, weighted by importance (luminance times solid angle). With the centroid the first-order error of
a stratum cancels; what is left grows with its scatter

    sum_i w_i |d_i - centroid|^2   (w_i importance, d_i unit vectors to its parts),

so the stratum with the most scatter is split next, across the axis of its largest spread, where the two halves keep
the least scatter. A median cut (Debevec 2005, "A Median Cut Algorithm for Light Probe Sampling") needs up to twice as
many lights for the same picture (docs/experiments/renderer-agreement.md).
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np

from smokelift.checks import Array, Doubles, Indices
from smokelift.footage.image_files import ImageError, read_image
from smokelift.footage.images import LUMINANCE
from smokelift.render.renderer import Image, Optics, Volume
from smokelift.scene import Camera, CompleteScene, DirectionalLight, Domain, EnvironmentLight, FiniteLight, Medium
from smokelift.scene.camera import voxel_width

CELLS = (256, 512)
"""Rows and columns of the cells that strata are made of, 0.7 degrees: a sun is one to four of them."""

ROUNDING = 1e-9
"""Relative difference below which two sums are equal. Processors and their libraries add in different orders."""

MIN_LIGHTS, MAX_LIGHTS = 4, 256
"""Numbers of lights that `environment_count` chooses between (docs/experiments/renderer-agreement.md)."""

TOLERANCE = 0.01
"""Relative L2 change of the picture at which lights are enough. Single scattering at a voxel a step is itself good to a
few tenths of a percent, and one code value of an 8-bit picture is half a percent of middle gray
(docs/experiments/renderer-agreement.md)."""

REFERENCE_VOXELS = 28
"""Voxels along the longest edge of the smoke that the number is chosen with: enough for its lumps, and quick."""

REFERENCE_PIXELS = 96
"""Pixels along the longer side of its picture, at most."""

REFERENCE_DEPTH = 3.0
"""Optical depth through its thickest part: dense enough for shadows, thin enough to be lit on all sides."""


def sampled_lights(scene: CompleteScene) -> tuple[FiniteLight, ...]:
    """The lights of a scene, in which an environment has become as many parallel lights as it needs.

    That number is found with the scene's own camera, where it is in the first frame. It is the same for every other
    camera and frame, so that a sequence is lit alike from all sides.
    """
    lights: list[FiniteLight] = []
    for light in scene.lights:
        if isinstance(light, EnvironmentLight):
            lights += _environment(light, scene.camera.at(0), scene.domain, scene.medium)
        else:
            lights += light.samples()
    return tuple(lights)


@lru_cache(maxsize=4)
def _environment(
    light: EnvironmentLight, camera: Camera, domain: Domain, medium: Medium
) -> tuple[DirectionalLight, ...]:
    return EnvironmentCells(light).lights(light.directions or environment_count(light, camera, domain, medium))


def environment_count(light: EnvironmentLight, camera: Camera, domain: Domain, medium: Medium) -> int:
    """Choose the number of lights for an environment by convergence.

    A ball of lumps and hollows that fills the domain is rendered in the medium before black with 4, 8, 16, ... lights,
    until doubling their number changes the picture by at most `TOLERANCE`, or the number is 256. Under six kinds of
    surroundings, a plume then came within 0.2 to 1.3 % of its picture with 512 lights
    (docs/experiments/renderer-agreement.md).
    """
    voxel = max(domain.size) / REFERENCE_VOXELS
    x, y, z = (max(round(edge / voxel), 1) for edge in domain.size)
    small, (width, height) = domain.about_center((x, y, z), voxel), camera.size
    # pixels about as wide as voxels at the domain's center
    shrink = max(1.0, voxel_width(camera, small), max(width, height) / REFERENCE_PIXELS)
    view = camera.resized(max(1, round(width / shrink)), max(1, round(height / shrink)))
    ball = _reference_density(small, medium)
    cells = EnvironmentCells(light)

    def picture(lights: int) -> Image:
        return Optics(small, medium, cells.lights(lights)).renderer(view, np.zeros(3, np.float32)).image(ball)

    count, image = MIN_LIGHTS, picture(MIN_LIGHTS)
    while count < MAX_LIGHTS:
        finer = picture(2 * count)
        if np.linalg.norm(finer - image) <= TOLERANCE * np.linalg.norm(finer):
            break
        count, image = 2 * count, finer
    return count


def _reference_density(domain: Domain, medium: Medium) -> Volume:
    """A ball of lumps and hollows that fills the domain, of optical depth 3 through its thickest part."""
    x, y, z = np.meshgrid(*((2 * np.arange(n) + 1) / n - 1 for n in domain.resolution), indexing="ij")
    lumps = np.maximum(1 + 4 * np.sin(9 * x) * np.sin(8 * y + 1) * np.sin(7 * z + 2), 0)
    ball = np.maximum(1 - (x * x + y * y + z * z), 0) * lumps
    thickest = domain.voxel_size * min(ball.sum(axis).max() for axis in range(3))
    return np.asarray(ball * REFERENCE_DEPTH / (medium.extinction * thickest), np.float32)


class EnvironmentCells:
    """The parts of an environment's picture that are not black, read once for any number of lights.

    The picture is read as Blender reads it: towards a direction (x, y, z) lies the point u = 1/2 - atan2(y, x) / 2 pi
    from the left, v = 1/2 + asin(z) / pi from the bottom. ``rotation_degrees`` is the Z rotation of Blender's Mapping
    node (type Point) before an Environment Texture: it turns the direction that is looked up counter-clockwise, so the
    surroundings turn clockwise, seen from above. Radiance is constant over a texel. Negative values, which resampling
    filters leave in pictures, count as 0.

    An ImageError is raised if the picture cannot be read or holds values that are not finite.
    """

    def __init__(self, light: EnvironmentLight) -> None:
        self.rotation = np.radians(light.rotation_degrees)
        picture = read_image(light.image)
        if not np.isfinite(picture).all():
            raise ImageError(
                f"{light.image}: holds values that are not finite; save it with 32-bit floats, or clamp its values"
            )
        irradiance, direction = _gather(picture)
        importance = irradiance @ LUMINANCE
        lit = importance * light.strength > 0
        self.irradiance = light.strength * irradiance[lit]
        """(cells, 3): integral of radiance over the cell, W/m^2."""
        self.importance = importance[lit]
        """(cells,): its luminance."""
        self.direction = direction[lit]
        """(cells, 3): unit vector towards the cell in the picture's own frame, that is before the rotation."""

    def lights(self, count: int) -> tuple[DirectionalLight, ...]:
        """Return parallel lights, at most so many; fewer for a picture with fewer bright parts.

        Their irradiance is in W/m^2 (perpendicular to the direction) a channel; its sum is the integral of the radiance
        over the sphere. Every machine finds the same.
        """
        if count < 1:
            raise ValueError(f"An environment needs at least 1 light, not {count}.")
        return tuple(self._light(stratum) for stratum in self._strata(count))

    def _light(self, stratum: Indices) -> DirectionalLight:
        weight = self.importance[stratum]
        x, y, z = weight @ self.direction[stratum]
        if np.linalg.norm((x, y, z)) < 1e-6 * weight.sum():
            x, y, z = 0.0, 0.0, 1.0  # as bright on every side: as good as any
        cosine, sine = np.cos(self.rotation), np.sin(self.rotation)
        towards = float(cosine * x + sine * y), float(cosine * y - sine * x), float(z)
        red, green, blue = (float(v) for v in self.irradiance[stratum].sum(0))
        return DirectionalLight((-towards[0], -towards[1], -towards[2]), (red, green, blue))

    def _strata(self, count: int) -> list[Indices]:
        """Cells of each stratum; there are no empty ones."""
        strata = [np.arange(len(self.importance))] if len(self.importance) else []
        scatter = [self._scatter(stratum) for stratum in strata]
        while len(strata) < count and max(scatter, default=0.0) > 0:
            worst = _first_largest(np.array(scatter))
            strata[worst : worst + 1] = halves = self._split(strata[worst])
            scatter[worst : worst + 1] = [self._scatter(half) for half in halves]
        return strata

    def _scatter(self, stratum: Indices) -> float:
        if len(stratum) == 1:
            return 0.0
        weight = self.importance[stratum]
        moment = weight @ self.direction[stratum]
        return float(weight.sum() - moment @ moment / weight.sum())

    def _split(self, stratum: Indices) -> list[Indices]:
        weight, direction = self.importance[stratum], self.direction[stratum]
        spread = weight @ np.square(direction) - np.square(weight @ direction) / weight.sum()
        along = direction[:, _first_largest(spread)]
        # cells of one row, or of mirrored halves, lie equally far along the axis but for rounding
        order = np.argsort(np.rint(along / ROUNDING), kind="stable")
        weight, moment = weight[order], (weight[:, None] * direction)[order]
        concentration = _concentration(weight, moment)[:-1] + _concentration(weight[::-1], moment[::-1])[-2::-1]
        cut = _first_largest(concentration) + 1
        return [stratum[order[:cut]], stratum[order[cut:]]]


def _concentration(weight: Doubles, moment: Doubles) -> Doubles:
    """|moment|^2 / weight of the first one, two, ... cells: their weight less their scatter."""
    return np.asarray(np.square(np.cumsum(moment, axis=0)).sum(-1) / np.cumsum(weight))


def _first_largest(values: Doubles) -> int:
    """The first of the values that are the largest but for rounding."""
    return int(np.argmax(values >= values.max() * (1 - ROUNDING)))


def _gather(picture: Array) -> tuple[Doubles, Doubles]:
    """Sum a picture up over `CELLS`.

    It returns the integrals of radiance over the cells (cells, 3), and unit vectors to their centroids (cells, 3),
    weighted by luminance; arbitrary for a black cell.
    """
    rows, columns = picture.shape[:2]
    finer = -(-CELLS[0] // rows), -(-CELLS[1] // columns)  # texels larger than cells are cut
    rows, columns = rows * finer[0], columns * finer[1]
    azimuth = 2 * np.pi * (0.5 - (np.arange(columns) + 0.5) / columns)
    sine = np.sin(np.pi * (0.5 - np.arange(rows + 1) / rows))  # of the elevation of the texels' edges
    first_column = np.arange(CELLS[1]) * columns // CELLS[1]
    irradiance, moment = np.zeros((*CELLS, 3)), np.zeros((*CELLS, 3))
    for cell_row, (top, bottom) in enumerate(pairwise(np.arange(CELLS[0] + 1) * rows // CELLS[0])):
        radiance = np.maximum(picture[np.arange(top, bottom) // finer[0]], 0).repeat(finer[1], axis=1)
        solid_angle = 2 * np.pi / columns * (sine[top:bottom] - sine[top + 1 : bottom + 1])
        part = radiance * solid_angle[:, None, None]
        z = (sine[top:bottom] + sine[top + 1 : bottom + 1])[:, None] / 2
        level = np.sqrt(1 - z * z)
        towards = np.stack(np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), z), -1)
        irradiance[cell_row] = np.add.reduceat(part.sum(0), first_column)
        moment[cell_row] = np.add.reduceat(((part @ LUMINANCE)[..., None] * towards).sum(0), first_column)
    moment /= np.maximum(np.linalg.norm(moment, axis=-1, keepdims=True), np.finfo(float).tiny)
    return irradiance.reshape(-1, 3), moment.reshape(-1, 3)
