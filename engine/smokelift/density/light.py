"""Where in depth the smoke stands, and how it leans, from lamps of different colours.

In light of one colour a picture says little about it: whatever a wrong depth does to the shading, more or less smoke on
the ray undoes. Lamps of different colours in different places are told apart in every pixel, more smoke makes no red
light blue, and what is near a lamp gets more of its light. So the smoke's axis

    y0(z) = y_found + shift + lean (z - z_mean)

is chosen that leaves the least of the picture unexplained when every ray holds as much smoke as suits it best. That is
looked at on a coarse grid, in a few frames. docs/accuracy.md has what was tried with other lights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.axis import SmokeAxis
from smokelift.density.hull import project_voxels, visual_hull
from smokelift.density.profile import DepthProfile
from smokelift.density.screen import upright_rows, view_frame
from smokelift.footage.images import area_average
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plate, noise_at
from smokelift.render import Renderer, scene_lights
from smokelift.render.light_sweeps import lighting
from smokelift.render.renderer import Image
from smokelift.scene import Domain, Medium, PointLight, Scene

COARSE = 48
"""Voxels along the longest side of the grid that the depth is looked for on."""

PIXELS = 2
"""Pixels to one of its voxels."""

ROUNDS = 8
"""Times that the rays' smoke is mended for one axis, from that of the axis before."""

WIDEST = 0.3
"""Shift (in twice the standard deviation of the smoke's height) and lean, to both sides, that are tried first."""

STEPS = (0.15, 0.08)
"""Those by which the best of them is mended, one after the other."""

FEWEST = 50
"""Pixels that have to count for a picture to be looked at."""

INSIDE = 0.97
"""Share of the profile inside the box from which a ray counts, wherever the axis is tried."""

LEAST_CHANGE = 0.3
"""Relative change of one colour against another from the middle of the box to its front or back from which lamps tell
depth: with less, what the profile does not know of the smoke's shape shades it more than its place does."""

LEAST_GAIN = 0.1
"""Share of the misfit that has to go, or the axis stays."""


def refine_axis(
    axis: SmokeAxis, pictures: Sequence[tuple[Image, NDArray[np.float32]]], scene: Scene, plate: Plate
) -> SmokeAxis:
    """Shift and lean the axis as the colours of the light say.

    Parameters
    ----------
    axis
        What is known without the light.
    pictures
        Of a few frames, each (rows, columns, 3), with the optical depth (rows, columns) that unshadowed smoke has.
    scene
        With the camera of the pictures and a domain as fine as them.
    plate
        Background of the pictures, with their noise.

    Returns
    -------
    SmokeAxis
        The same if the light is not that of lamps of different colours alone, or says too little.
    """
    assert scene.camera is not None and scene.domain is not None
    domain = _coarse(scene.domain)
    if axis.columns or not pictures or not _telling(scene, domain):
        return axis
    rows = [upright_rows(amount, scene.camera, scene.domain) for _, amount in pictures]
    heights = rows[0].heights
    total = np.sum([row.total for row in rows], 0)
    if not total.any():
        return axis
    mean = float(np.average(heights, weights=total))
    size = 2 * float(np.sqrt(np.average((heights - mean) ** 2, weights=total)))

    found = float(np.average(axis.at(heights), weights=total))

    def moved(place: NDArray[np.float64]) -> SmokeAxis:
        return SmokeAxis(heights, found + size * place[0] + place[1] * (heights - mean), np.zeros_like(heights))

    grid = [WIDEST * np.array((shift, lean)) for shift in (-1, 0, 1) for lean in (-1, 0, 1)]
    corners = [moved(place) for place in grid if place.all()]
    looks = [_Look(picture, amount, scene, domain, plate, corners) for picture, amount in pictures]
    looks = [look for look in looks if look.counts > FEWEST]
    if not looks:
        return axis

    def misfit(tried: SmokeAxis) -> float:
        return float(np.mean([np.log(look.misfit(tried)) for look in looks]))

    misfit(axis)  # from here on the rays hold about what they should
    start = misfit(axis)
    best, place = min(((misfit(moved(place)), place) for place in grid), key=lambda result: result[0])
    for step in STEPS:
        for aside in step * np.eye(2):
            low, high = misfit(moved(place - aside)), misfit(moved(place + aside))
            bend = low + high - 2 * best
            go = float(np.clip((low - high) / (2 * bend), -1, 1)) if bend > 0 else 0.0
            tried = [(best, place), (low, place - aside), (high, place + aside)]
            tried.append((misfit(moved(place + go * aside)), place + go * aside))
            best, place = min(tried, key=lambda result: result[0])
    return moved(place) if start - best > LEAST_GAIN else axis


def _telling(scene: Scene, domain: Domain) -> bool:
    """Whether the light is that of lamps alone whose colours mix differently in the front and in the back."""
    assert scene.camera is not None
    lamps = [light for light in scene.lights if isinstance(light, PointLight)]
    if len(lamps) < len(scene.lights) or any(domain.contains(lamp.position) for lamp in lamps):
        return False
    if lighting(lamps, domain, (0, 0, 0), domain.resolution).channels < 3:
        return False
    offset = np.array([lamp.position for lamp in lamps]) - np.array(domain.centre)
    colour = np.array([lamp.intensity for lamp in lamps]) / np.sum(offset**2, 1, keepdims=True)
    # irradiance falls off as 1 / r^2, so along the depth by 2 depth / r^2, relatively
    slope = 2 * (offset @ view_frame(scene.camera)[1]) / np.sum(offset**2, 1)
    change = (slope @ colour) / np.maximum(colour.sum(0), 1e-30)
    reach = float(np.abs(view_frame(scene.camera)[1]) @ (np.array(domain.max) - np.array(domain.centre)))
    return bool(reach * np.ptp(change) > LEAST_CHANGE)


class _Look:
    """One picture, and how badly an axis explains it."""

    def __init__(
        self,
        picture: Image,
        amount: NDArray[np.float32],
        scene: Scene,
        domain: Domain,
        plate: Plate,
        corners: Sequence[SmokeAxis],
    ) -> None:
        assert scene.camera is not None and scene.domain is not None
        shrink = PIXELS * scene.domain.voxel_size / domain.voxel_size
        self._size = tuple(max(1, round(shrink / PIXELS * n)) for n in scene.camera.size)
        columns, rows = (PIXELS * n for n in self._size)
        fine, self._camera = scene.camera.resized(columns, rows), scene.camera.resized(*self._size)
        self._picture = area_average(picture, columns, rows)
        self._background = area_average(plate.image, columns, rows)
        self._amount = area_average(amount, *self._size) + np.float32(1e-3)
        self._domain, self._medium = domain, scene.medium or Medium()
        small = replace(plate, image=self._background, confidence=area_average(plate.confidence, columns, rows))
        mask = ndimage.binary_dilation(matte(self._picture, small).mask, iterations=PIXELS)
        for corner in corners:
            mask &= DepthProfile(area_average(amount, columns, rows), fine, domain, corner).share_inside() > INSIDE
        self.counts = int(mask.sum())
        self._weight = mask / np.mean(np.square(noise_at(self._picture, small)), -1)
        self._projection = project_voxels(self._camera, domain)
        self._hull = visual_hull(self._amount > 0.01 * self._amount.max(), self._projection)
        lights = scene_lights(scene)
        self._renderer = Renderer(fine, domain, self._medium, lights, self._background, "single", self._hull)
        self._scale = np.zeros(self._amount.shape, np.float32)

    def misfit(self, axis: SmokeAxis) -> float:
        """Mean square of what no amount of smoke on the rays explains, in units of the noise."""
        profile = DepthProfile(self._amount, self._camera, self._domain, axis).at(self._projection, self._hull)
        base = self._projection.read(self._amount, self._hull) * profile / self._medium.extinction
        density = np.zeros(self._domain.resolution, np.float32)
        least = np.inf
        for _ in range(ROUNDS):
            density[self._hull] = base * np.exp(self._projection.read(self._scale, self._hull))
            left = self._picture - self._renderer.image(density)
            least = min(least, float(np.sum(self._weight[..., None] * left**2) / (3 * self.counts)))
            self._scale = np.clip(self._scale + self._step(left), -4, 3)
        return least

    def _step(self, left: Image) -> NDArray[np.float32]:
        """Change of the logarithm of each ray's smoke that explains most of what is left, by least squares."""
        clear = self._renderer.transmittance[..., None]
        source = (self._picture - left - clear * self._background) / np.maximum(1 - clear, 1e-6)
        slope = clear * np.log(np.maximum(clear, 1e-6)) * (self._background - source)
        wanted, power = (
            ndimage.gaussian_filter(area_average(self._weight * np.sum(part, -1), *self._size), 0.7)
            for part in (left * slope, slope**2)
        )
        return np.asarray(0.9 * np.clip(wanted / (power + 2), -0.7, 0.7), np.float32)


def _coarse(domain: Domain) -> Domain:
    """The domain, or a little more, in whole blocks of its voxels."""
    block = -(-max(domain.resolution) // COARSE)
    counts = [-(-n // block) for n in domain.resolution]
    x, y, z = (low + n * block * domain.voxel_size for low, n in zip(domain.min, counts, strict=True))
    return Domain(domain.min, (x, y, z), (counts[0], counts[1], counts[2]))
