"""How many voxels the smoke's detail asks for, as far as it stands out from the clip's noise.

The spectrum of what the smoke changes is compared with that of the noise beside it. It is a cosine transform of sRGB
values, in which a clip's noise is even. A grid shows what is coarser than two of its voxels, and loses the part of the
contrast that is finer. Figures: docs/experiments/clip-pixels.md.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from smokelift.checks import Doubles, Figures, Finding
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate
from smokelift.footage.images import linear_to_srgb
from smokelift.render.renderer import Image
from smokelift.scene import Domain
from smokelift.setup.settings import LOST_DETAIL, QUALITIES, Quality, Settings

Shape = tuple[int, int, int]

RINGS = 256
"""Rings of equal width of spatial frequency, up to that of single pixels: in a picture of up to 1,024 pixels they are
finer than the step of four voxels from one grid to the next."""

NORMAL_MEDIAN = 1.4826
"""Standard deviation of normal noise over the median of its size (by definition)."""


@dataclass(frozen=True)
class Grid:
    """The voxels (x, y, z) that a quality takes for a clip.

    ``lost`` is the part of the smoke's contrast that is finer than they show; None where that was not measured.
    """

    resolution: Shape
    lost: float | None


@dataclass(frozen=True, eq=False)
class DetailSpectrum:
    """The energy (RINGS,) of the smoke's picture beyond the noise, by spatial frequency.

    ``pixels`` of the picture lie along the longest side of the box.
    """

    energy: Doubles
    pixels: float

    def lost(self, longest: float, finest: float | None = None) -> float:
        """Fraction of the clip's contrast (root of the energy) that a grid with ``longest`` voxels in a row loses.

        With ``finest``, only what a grid of so many voxels shows counts as lost.
        """
        whole = float(self.energy.sum())
        if whole <= 0:
            return 0.0
        # the first rings that grids do not show; as many voxels as pixels show all
        first, end = (min(round(RINGS * voxels / self.pixels), RINGS) for voxels in (longest, finest or self.pixels))
        return float(np.sqrt(self.energy[first:end].sum() / whole))


def proportional(resolution: Shape, least: int, most: int) -> list[Shape]:
    """Return the resolutions of the same proportions, ``least`` to ``most`` voxels long, the coarsest first."""
    common = math.gcd(*resolution)
    x, y, z = (n // common for n in resolution)
    longest = max(x, y, z)
    return [(x * times, y * times, z * times) for times in range(-(-least // longest), most // longest + 1)]


def choose_grid(
    allowed: Mapping[Quality, Sequence[Domain]], spectrum: DetailSpectrum | None, settings: Settings
) -> tuple[Domain, Finding, Mapping[Quality, Grid]]:
    """Choose the coarsest of a quality's grids that loses no more of what the finest shows than tolerated.

    ``allowed`` are those of each quality, the coarsest first; ``spectrum`` is the smoke's detail in the finest of the
    settings' quality, None without smoke. Returned are the grid, why it is that one, and what each quality would take.
    """
    own = allowed[settings.quality]
    if spectrum is None:
        shape = own[0].resolution
        unseen = Finding("resolution without smoke", about="resolution", value=shape, source="assumed")
        return own[0], unseen, dict.fromkeys(QUALITIES, Grid(shape, None))

    def coarsest(grids: Sequence[Domain], tolerance: float) -> Domain:
        finest = max(grids[-1].resolution)
        return next((grid for grid in grids if spectrum.lost(max(grid.resolution), finest) <= tolerance), grids[-1])

    taken = {quality: coarsest(grids, LOST_DETAIL[quality]) for quality, grids in allowed.items()}
    domain = taken[settings.quality]
    longest = max(domain.resolution)
    figures: Figures = {
        "lost": spectrum.lost(longest),
        "lost_beside_finest": spectrum.lost(longest, max(own[-1].resolution)),
        "pixels": spectrum.pixels,
        "quality": settings.quality,
        "tolerance": LOST_DETAIL[settings.quality],
    }
    qualities = {name: Grid(grid.resolution, spectrum.lost(max(grid.resolution))) for name, grid in taken.items()}
    why = Finding("resolution", figures, about="resolution", value=domain.resolution, source="measured")
    return domain, why, qualities


def smoke_detail(frames: Iterable[tuple[Image, Plate]], pixels: float) -> DetailSpectrum:
    """Measure the smoke's detail in linear pictures (rows, columns, 3) of the box before their plates.

    ``pixels`` lie along the longest side of the box.
    """
    energy = np.zeros(RINGS)
    for picture, plate in frames:
        change = (linear_to_srgb(picture) - linear_to_srgb(plate.image)).mean(-1, dtype=np.float64)
        noise, still = float(plate.noise.total.mean()), ~matte(picture, plate).mask
        # the channels' mean has less noise; the median stays with pixels that have no thin smoke below the mask
        if still.any():
            noise = min(noise, NORMAL_MEDIAN * float(np.median(np.abs(change[still]))))
        energy += _beyond_noise(change, noise)
    return DetailSpectrum(energy, pixels)


def _beyond_noise(change: Doubles, noise: float) -> Doubles:
    """Energy (RINGS,) of a picture, less that of white noise of a standard deviation."""
    # a cosine transform mirrors the picture at its edge, so smoke that is cut off there is no detail
    power = np.square(scipy.fft.dctn(change, norm="ortho"))
    rows, columns = (np.arange(n) / n for n in change.shape)
    # a frequency of 1 alternates from pixel to pixel
    frequency = np.hypot(rows[:, None], columns)
    inside = frequency < 1
    ring = (RINGS * frequency[inside]).astype(int)
    total = np.bincount(ring, power[inside], RINGS)
    count = np.bincount(ring, minlength=RINGS)
    return np.asarray(np.maximum(total - count * noise**2, 0))
