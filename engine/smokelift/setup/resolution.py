"""How many voxels the smoke's detail in a clip asks for, in so far as that detail stands out from the noise.

The spectrum of what the smoke changes in the picture (cosine transform, in sRGB values, where a clip's noise is even)
is compared with that of the noise, which is measured in pixels without smoke. A grid shows what is coarser than two of
its voxels; the share of the smoke's contrast that is finer is what it loses. Figures:
docs/experiments/resolution-selection.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.footage.images import area_average, linear_to_srgb
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plate
from smokelift.render.renderer import Image
from smokelift.scene import Domain
from smokelift.setup.estimate import Estimate, Grid, measured
from smokelift.setup.settings import LOST_DETAIL, QUALITIES, Quality, Settings

Shape = tuple[int, int, int]

OUTLINE = 320
"""Pixels along the longer side of the picture, at most, in which the smoke is found. Noise is measured beside it
(docs/experiments/resolution-selection.md)."""

EDGE = 3
"""Width of the margin around the smoke, in these pixels, in which there may be some that is too thin to be found
(docs/experiments/resolution-selection.md)."""

MIN_STILL_SHARE = 0.05
"""Share of the picture without smoke from which its noise is measured there."""

RINGS_AN_OCTAVE = 16
"""Rings of an octave, into which spatial frequencies are sorted: 4 % wide, about as far apart as the grids are."""

RINGS = 6 * RINGS_AN_OCTAVE
"""Rings from single pixels of the picture down to a 64th of their frequency, where what is coarser counts as well."""


@dataclass(frozen=True, eq=False)
class DetailSpectrum:
    """The energy of the smoke's picture beyond the noise, by spatial frequency.

    Attributes
    ----------
    energy : (RINGS,)
        In rings of the logarithm of the frequency, up to that of single pixels.
    pixels
        Along the longest side of the box.
    """

    energy: NDArray[np.float64]
    pixels: float

    def lost(self, longest: float, finest: float | None = None) -> float:
        """Share of the contrast (root of the energy) that is finer than a grid of so many voxels shows.

        Of what the clip shows, or a grid of ``finest`` voxels.
        """
        whole = float(self.energy.sum())
        if whole <= 0:
            return 0.0
        between = self.energy[self._ring(longest) : RINGS if finest is None else self._ring(finest)]
        return float(np.sqrt(between.sum() / whole))

    def _ring(self, longest: float) -> int:
        """The first ring that a grid does not show."""
        return round(float(np.clip(RINGS + RINGS_AN_OCTAVE * np.log2(longest / self.pixels), 0, RINGS)))


def choose_grid(
    grids: Callable[[Quality], Sequence[Domain]], detail: Callable[[Domain], DetailSpectrum | None], settings: Settings
) -> tuple[Domain, Estimate[Shape], Mapping[Quality, Grid]]:
    """Choose the coarsest of a quality's grids that loses no more of what the finest shows than tolerated.

    Parameters
    ----------
    grids
        Returns those that a quality allows, the coarsest first.
    detail
        Returns the detail of the smoke in a box; None without smoke.
    settings
        With the quality and the tolerance.

    Returns
    -------
    The grid, why it is that one, and what each quality would take of this clip.
    """
    own = grids(settings.quality)
    spectrum = detail(own[-1])
    if spectrum is None:
        shape = own[0].resolution
        unseen = Estimate("resolution without smoke", what="resolution", value=shape, source="assumed")
        return own[0], unseen, dict.fromkeys(QUALITIES, Grid(shape, None))

    def coarsest(allowed: Sequence[Domain], tolerance: float) -> Domain:
        finest = max(allowed[-1].resolution)
        return next((grid for grid in allowed if spectrum.lost(max(grid.resolution), finest) <= tolerance), allowed[-1])

    tolerance = settings.selection.lost_detail
    domain = coarsest(own, tolerance)
    longest = max(domain.resolution)
    figures = {
        "lost": spectrum.lost(longest),
        "lost_beside_finest": spectrum.lost(longest, max(own[-1].resolution)),
        "pixels": spectrum.pixels,
        "quality": settings.quality,
    }
    taken = {quality: coarsest(grids(quality), LOST_DETAIL[quality]) for quality in QUALITIES}
    taken[settings.quality] = domain
    qualities = {name: Grid(grid.resolution, spectrum.lost(max(grid.resolution))) for name, grid in taken.items()}
    return domain, measured("resolution", domain.resolution, figures, tolerance=tolerance), qualities


def smoke_detail(frames: Iterable[tuple[Image, Plate]], pixels: float) -> DetailSpectrum:
    """Measure the detail in parts of linear pictures (rows, columns, 3) where the box is, and the plates behind them.

    So many pixels lie along the longest side of the box.
    """
    energy = np.zeros(RINGS)
    for picture, plate in frames:
        change = (linear_to_srgb(picture) - linear_to_srgb(plate.image)).mean(-1, dtype=np.float64)
        noise = _noise(change, _still(picture, plate), float(plate.noise.total.mean()))
        energy += _beyond_noise(change, noise)
    return DetailSpectrum(energy, pixels)


def _still(picture: Image, plate: Plate) -> NDArray[np.bool_]:
    """Pixels (rows, columns) that show no smoke for certain."""
    sides = np.array(picture.shape[:2])
    rows, columns = np.maximum(sides * min(1.0, OUTLINE / sides.max()), 1).astype(int)
    pixels = float(sides.prod() / (rows * columns))
    small = plate.through(lambda full: area_average(full, columns, rows), pixels)
    still = ~ndimage.binary_dilation(matte(area_average(picture, columns, rows), small).mask, iterations=EDGE)
    return np.asarray(still[np.ix_(*(np.arange(n) * m // n for n, m in zip(sides, still.shape, strict=True)))])


def _noise(change: NDArray[np.float64], still: NDArray[np.bool_], otherwise: float) -> float:
    """Standard deviation of the noise: of the still pixels, if there are enough."""
    return float(np.sqrt(np.mean(change[still] ** 2))) if still.mean() > MIN_STILL_SHARE else otherwise


def _beyond_noise(change: NDArray[np.float64], noise: float) -> NDArray[np.float64]:
    """Energy of a picture in each ring, less that of white noise of a standard deviation."""
    # a cosine transform goes on beyond the edge as in a mirror, so that smoke which is cut off there is no detail
    power = np.square(scipy.fft.dctn(change, norm="ortho"))
    across = [np.arange(n) / n for n in change.shape]
    # 1 alternates from pixel to pixel
    frequency = np.hypot(across[0][:, None], across[1])
    ring = RINGS + np.floor(RINGS_AN_OCTAVE * np.log2(np.maximum(frequency, 2.0**-6))).astype(int)
    inside = frequency < 1
    total = np.bincount(ring[inside], power[inside], RINGS)
    count = np.bincount(ring[inside], minlength=RINGS)
    beyond: NDArray[np.float64] = np.maximum(total - count * noise**2, 0)
    return beyond
