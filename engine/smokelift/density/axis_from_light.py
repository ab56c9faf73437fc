"""Where in depth the smoke stands, and how it leans, from lamps of different colours.

In light of one colour a picture hardly shows it: whatever a wrong depth does to the shading, more or less smoke on the
ray undoes. Lamps of different colours in different places can be told apart in every pixel, because more smoke makes no
red light blue, and smoke near a lamp gets more of its light. So the axis

    y0(z) = y_found + shift + lean (z - z_mean)

is chosen whose picture is nearest to the clip's when every ray holds the amount of smoke that fits it best. The search
runs on a coarse grid, in a few frames (docs/experiments/density-axis-light.md).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.axis import AxisEstimate, SmokeAxis
from smokelift.density.hull import project_voxels, visual_hull
from smokelift.density.observation import Observation, View
from smokelift.density.profile import DepthProfile
from smokelift.density.screen import reach_along, upright_rows, view_frame
from smokelift.footage.images import area_average
from smokelift.footage.matte import matte
from smokelift.footage.plate import noise_at
from smokelift.render import Image, Optics
from smokelift.render.light_sweeps import lighting
from smokelift.scene import Camera, Domain, PointLight


@dataclass(frozen=True)
class LightSearch:
    """How the axis is searched for.

    Attributes
    ----------
    voxels
        Along the longest side of the coarse grid.
    pixels
        Along one of its voxels.
    rounds
        Times that the amounts of smoke on the rays are corrected for one axis, from those of the axis before.
    widest
        Shift (in twice the standard deviation of the smoke's height) and lean, to both sides, of the first tries.
    steps
        Those of the tries around the best, one after the other.
    least_pixels
        Pixels that a picture needs to count.
    inside
        Share of the profile inside the box from which a ray counts, wherever the axis is tried.
    least_contrast
        Relative change of one colour against another, from the middle of the box to its front or back, from which lamps
        show depth. With less, the smoke's unknown shape shades it more than its place does.
    least_gain
        Fall of the logarithm of the misfit without which the axis stays.
    """

    voxels: int = 48
    pixels: int = 2
    rounds: int = 8
    widest: float = 0.3
    steps: tuple[float, ...] = (0.15, 0.08)
    least_pixels: int = 50
    inside: float = 0.97
    least_contrast: float = 0.3
    least_gain: float = 0.1


def refine_axis(
    estimate: AxisEstimate, seen: Sequence[Observation], optics: Optics, search: LightSearch = LightSearch()
) -> AxisEstimate:
    """Shift and lean the axis as the colours of the light ask for.

    Parameters
    ----------
    estimate
        What is known without the light.
    seen
        A few frames of one camera that stands still.
    optics
        With a domain as fine as the pictures.
    search
        How the axis is searched for.

    Returns
    -------
    AxisEstimate
        The same one if the light is not that of lamps of different colours alone, or shows too little.
    """
    axis, coarse = estimate.axis, replace(optics, domain=coarse_domain(optics.domain, search.voxels))
    if axis.columns or not seen or _colour_contrast(seen[0].camera, coarse) <= search.least_contrast:
        return estimate
    views = [view for view in (View.of(observation, optics) for observation in seen) if view.optical_depth.any()]
    if not views:
        return estimate
    rows = [upright_rows(view.optical_depth, view.camera, optics.domain) for view in views]
    heights, total = rows[0].heights, np.sum([row.total for row in rows], 0)
    if not total.any():
        return estimate
    mean = float(np.average(heights, weights=total))
    size = 2 * float(np.sqrt(np.average((heights - mean) ** 2, weights=total)))
    found = float(np.average(axis.at(heights), weights=total))

    def moved(place: NDArray[np.float64]) -> SmokeAxis:
        return SmokeAxis(heights, found + size * place[0] + place[1] * (heights - mean), np.zeros_like(heights))

    grid = [search.widest * np.array((shift, lean)) for shift in (-1, 0, 1) for lean in (-1, 0, 1)]
    corners = [moved(place) for place in grid if place.all()]
    pictures = [_CoarsePicture(view, optics.domain, coarse, corners, search) for view in views]
    pictures = [picture for picture in pictures if picture.counted > search.least_pixels]
    if not pictures:
        return estimate

    def misfit(tried: SmokeAxis) -> float:
        return float(np.mean([np.log(picture.misfit(tried)) for picture in pictures]))

    misfit(axis)  # from here on the rays hold about what they should
    start = misfit(axis)
    best, place = _minimum(lambda tried: misfit(moved(tried)), grid, search.steps)
    if start - best <= search.least_gain:
        return estimate
    # what the last tries are apart is twice the error that was measured on scenes whose depth is known
    return AxisEstimate(moved(place), "lamps", found + size * float(place[0]), size * search.steps[-1])


def _minimum(
    misfit: Callable[[NDArray[np.float64]], float], grid: Sequence[NDArray[np.float64]], steps: Sequence[float]
) -> tuple[float, NDArray[np.float64]]:
    """The least misfit and its place (2,): best of a grid, then along each axis by a parabola through three tries."""
    best, place = min(((misfit(tried), tried) for tried in grid), key=lambda result: result[0])
    for step in steps:
        for aside in step * np.eye(2):
            low, high = misfit(place - aside), misfit(place + aside)
            bend = low + high - 2 * best
            go = float(np.clip((low - high) / (2 * bend), -1, 1)) if bend > 0 else 0.0
            tries = [(best, place), (low, place - aside), (high, place + aside)]
            tries.append((misfit(place + go * aside), place + go * aside))
            best, place = min(tries, key=lambda result: result[0])
    return best, place


def _colour_contrast(camera: Camera, optics: Optics) -> float:
    """Relative change of one colour against another from the middle of the box to its front; 0 unless all are lamps."""
    domain, along = optics.domain, view_frame(camera)[1]
    lamps = [light for light in optics.lights if isinstance(light, PointLight)]
    if len(lamps) < len(optics.lights) or any(domain.contains(lamp.position) for lamp in lamps):
        return 0.0
    if lighting(lamps, domain, (0, 0, 0), domain.resolution).channels < 3:
        return 0.0
    offset = np.array([lamp.position for lamp in lamps]) - np.array(domain.centre)
    colour = np.array([lamp.intensity for lamp in lamps]) / np.sum(offset**2, 1, keepdims=True)
    # irradiance falls off as 1 / r^2, so along the depth by 2 depth / r^2, relatively
    slope = 2 * (offset @ along) / np.sum(offset**2, 1)
    change = (slope @ colour) / np.maximum(colour.sum(0), 1e-30)
    return float(reach_along(domain, along) * np.ptp(change))


class _CoarsePicture:
    """One picture on the coarse grid, and how badly an axis explains it."""

    def __init__(
        self, view: View, domain: Domain, optics: Optics, corners: Sequence[SmokeAxis], search: LightSearch
    ) -> None:
        coarse, pixels, self._rounds = optics.domain, search.pixels, search.rounds
        shrink = pixels * domain.voxel_size / coarse.voxel_size
        self._size = tuple(max(1, round(shrink / pixels * n)) for n in view.camera.size)
        columns, rows = (pixels * n for n in self._size)
        fine, self._camera = view.camera.resized(columns, rows), view.camera.resized(*self._size)
        self._picture = area_average(view.image, columns, rows)
        averaged = view.camera.size[0] * view.camera.size[1] / (columns * rows)
        small = view.plate.through(lambda whole: area_average(whole, columns, rows), averaged)
        self._background = small.image
        self._amount = area_average(view.optical_depth, *self._size) + np.float32(1e-3)
        self._optics = optics
        mask = ndimage.binary_dilation(matte(self._picture, small).mask, iterations=pixels)
        amount = area_average(view.optical_depth, columns, rows)
        for corner in corners:
            mask &= DepthProfile(amount, fine, coarse, corner).share_inside() > search.inside
        self.counted = int(mask.sum())
        self._weight = mask / np.mean(np.square(noise_at(self._picture, small)), -1)
        projection = project_voxels(self._camera, coarse)
        self._hull = visual_hull(self._amount > 0.01 * self._amount.max(), projection)
        self._places = projection.places(self._hull)
        self._renderer = optics.renderer(fine, self._background, self._hull)
        self._scale = np.zeros(self._amount.shape, np.float32)

    def misfit(self, axis: SmokeAxis) -> float:
        """Mean square of what no amount of smoke on the rays explains, in units of the noise."""
        profile = DepthProfile(self._amount, self._camera, self._optics.domain, axis).at(self._places, self._hull)
        base = self._places.read(self._amount) * profile / self._optics.medium.extinction
        density = np.zeros(self._optics.domain.resolution, np.float32)
        least = np.inf
        for _ in range(self._rounds):
            density[self._hull] = base * np.exp(self._places.read(self._scale))
            left = self._picture - self._renderer.image(density)
            least = min(least, float(np.sum(self._weight[..., None] * left**2) / (3 * self.counted)))
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


def coarse_domain(domain: Domain, longest: int) -> Domain:
    """The domain, or a little more, in whole blocks of its voxels, so many along the longest side at most."""
    block = -(-max(domain.resolution) // longest)
    counts = [-(-n // block) for n in domain.resolution]
    x, y, z = (low + n * block * domain.voxel_size for low, n in zip(domain.min, counts, strict=True))
    return Domain(domain.min, (x, y, z), (counts[0], counts[1], counts[2]))
