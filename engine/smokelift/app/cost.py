"""What a run takes, known before it is spent: time, memory and disk.

Time is counted in Poisson solves by cosine transforms. A frame takes about as many whatever the grid, and what a solve
takes on this machine is measured. All constants: docs/experiments/memory-and-time.md.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import psutil
import scipy.fft

from smokelift.scene import Domain
from smokelift.setup.settings import Quality, Settings

Resolution = tuple[int, int, int]

SOLVES_A_FRAME: Mapping[Quality, float] = {"draft": 54.0, "balanced": 58.0, "fine": 63.0, "final": 20.0}
"""Poisson solves that take as long as a frame. On the large grids of `final` smoke takes a small part of the box, and
its detail is found from coarse to fine."""

SHARE_A_VIEW = 0.5
"""Part of a frame's time that each further view adds."""

SHARE_OF_DETAIL = 0.4
"""Part of a frame's time that detail in depth adds: the smooth answer, and two rounds of three pictures more. It is
less where the fit to the clip takes longer."""

START_SECONDS = 5.0
"""Seconds to start, to compile and to estimate the background."""

BYTES_A_VOXEL_ON_DISK = 8
"""Bytes of a density and three velocities at 16 bits, where smoke fills the box. A quarter is usual."""

BYTES_A_VOXEL = 85
"""Bytes of memory at a run's peak, where two fifths of the voxels may hold smoke: what fills the box, and what a fit
needs of the voxels that may hold smoke (docs/experiments/memory-and-time.md)."""

BYTES_A_VOXEL_OF_SOLVER = 145
"""Bytes that a velocity adds whose estimate has the grid of the density: its solver's arrays."""

BYTES_A_VOXEL_OF_DETAIL = 20
"""Bytes that detail in depth adds: places and records of three pictures more, and the smooth answer of two frames."""

BYTES_A_PIXEL_OF_DETAIL = 4
"""Bytes of a pixel of every frame on the turntable's screen, 16 bits that are held twice while they are gathered."""

BASE_BYTES = 250 * 2**20
"""Bytes of memory for the interpreter, libraries, compiled kernels and decoded pictures."""

LARGEST_TIMED = 64
"""Voxels along a side of the grid whose solve is timed. Larger ones take as much longer as they have more voxels."""

LEAST_VOXELS = 8
"""Voxels along the shortest side of a grid that is suggested."""


class NotEnoughMemoryError(MemoryError):
    """The grid does not fit; says which would."""


@dataclass(frozen=True)
class Cost:
    """What a run takes.

    Attributes
    ----------
    seconds
        Right to a factor of two.
    memory, memory_free
        Bytes at the peak, and bytes that are free now.
    disk
        Bytes at most.
    """

    seconds: float
    memory: int
    memory_free: int
    disk: int


def estimate_cost(domain: Domain, frames: int, settings: Settings, further_views: int = 0) -> Cost:
    """Estimate the cost of a run over so many frames; it takes up to a second."""
    solves = frames * SOLVES_A_FRAME[settings.quality] * (1 + SHARE_A_VIEW * further_views)
    if settings.detail > 0:
        solves *= 1 + SHARE_OF_DETAIL
    return Cost(
        seconds=START_SECONDS + solves * _solve_seconds(domain.resolution),
        memory=memory_needed(domain.resolution, frames, settings),
        memory_free=memory_free(),
        disk=frames * math.prod(domain.resolution) * BYTES_A_VOXEL_ON_DISK,
    )


def memory_needed(resolution: Resolution, frames: int, settings: Settings) -> int:
    """Return the bytes that a run over so many frames takes at its peak."""
    voxels = math.prod(resolution)
    needed = BASE_BYTES + BYTES_A_VOXEL * voxels
    if settings.method == "paper" or settings.velocity.coarsening == 0:
        needed += BYTES_A_VOXEL_OF_SOLVER * voxels
    if settings.detail > 0:
        x, y, z = resolution
        needed += BYTES_A_VOXEL_OF_DETAIL * voxels + BYTES_A_PIXEL_OF_DETAIL * frames * math.ceil(math.hypot(x, y)) * z
    return needed


def memory_free() -> int:
    """Return the bytes that programs may still take."""
    return int(psutil.virtual_memory().available)


def require_memory(domain: Domain, frames: int, settings: Settings, *, given: bool = True) -> None:
    """Check that a run over so many frames fits into the memory that is free.

    A box that is ``given`` keeps its proportions, so that voxels stay cubes; one that was found follows its voxels.

    Raises
    ------
    NotEnoughMemoryError
        With the largest resolution of the same shape that fits.
    """
    free = memory_free()
    needed = memory_needed(domain.resolution, frames, settings)
    if needed <= free:
        return
    shape = " x ".join(map(str, domain.resolution))
    smaller = _same_proportions(domain.resolution) if given else _about_the_same(domain.resolution)
    fits = next((each for each in smaller if memory_needed(each, frames, settings) <= free), None)
    advice = (
        f"the largest that fits is --resolution {','.join(map(str, fits))}"
        if fits
        else "close other programs; no grid of this shape fits"
    )
    raise NotEnoughMemoryError(
        f"{shape} voxels need about {needed / 2**30:.1f} GiB of memory and {free / 2**30:.1f} GiB are free; {advice}."
    )


def _same_proportions(resolution: Resolution) -> Iterator[Resolution]:
    """Smaller resolutions of exactly the same proportions, the largest first."""
    common = math.gcd(*resolution)
    x, y, z = (n // common for n in resolution)
    candidates = ((x * times, y * times, z * times) for times in range(common - 1, 0, -1))
    return (each for each in candidates if min(each) >= LEAST_VOXELS)


def _about_the_same(resolution: Resolution) -> Iterator[Resolution]:
    """Smaller resolutions of the same proportions but for multiples of four, the largest first."""
    for longest in range(max(resolution) - 4, 0, -4):
        x, y, z = (4 * math.ceil(n * longest / max(resolution) / 4) for n in resolution)
        if min(x, y, z) >= LEAST_VOXELS:
            yield x, y, z


def _solve_seconds(resolution: Resolution) -> float:
    """Return the seconds that a Poisson solve takes on this machine now."""
    timed = [min(n, LARGEST_TIMED) for n in resolution]
    field = np.zeros(timed, np.float32)
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        scipy.fft.idctn(scipy.fft.dctn(field, workers=2), workers=2)
        spent.append(time.perf_counter() - began)
    return float(np.median(spent)) * math.prod(resolution) / math.prod(timed)
