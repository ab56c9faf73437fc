"""What a run will take, said before it is spent.

Time is foretold in a unit that machine and grid share with the run itself: Poisson solves by cosine transforms, of
which a frame takes about as many whatever the grid (docs/measurements.md).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.fft

from smokelift.app.memory import free_memory, needed
from smokelift.scene import Domain
from smokelift.setup.settings import Quality

SOLVES_A_FRAME: Mapping[Quality, float] = {"draft": 65.0, "balanced": 70.0, "fine": 76.0}
SHARE_A_VIEW = 0.5
"""Of a frame's time that every further view takes on top."""

START_SECONDS = 5.0
"""Starting, compiling and looking for the background."""

BYTES_A_VOXEL_ON_DISK = 8
"""A density and three velocities of 16 bits: reached where smoke fills the box, a quarter of it is usual."""

LARGEST_TIMED = 64
"""Voxels along a side of the grid that is timed; larger ones follow by their number of voxels."""


@dataclass(frozen=True)
class Forecast:
    """What a run will take.

    Attributes
    ----------
    seconds
        Time; right to a factor of two.
    memory, memory_free
        Bytes at the peak, and bytes that are there.
    disk
        Bytes at most.
    """

    seconds: float
    memory: int
    memory_free: int
    disk: int


def forecast(domain: Domain, frames: int, quality: Quality, views: int = 0) -> Forecast:
    """Foretell a run over so many frames, with so many further views."""
    voxels = domain.resolution[0] * domain.resolution[1] * domain.resolution[2]
    return Forecast(
        START_SECONDS
        + frames * SOLVES_A_FRAME[quality] * (1 + SHARE_A_VIEW * views) * _solve_seconds(domain.resolution),
        needed(domain.resolution),
        free_memory(),
        frames * voxels * BYTES_A_VOXEL_ON_DISK,
    )


def _solve_seconds(resolution: tuple[int, int, int]) -> float:
    """Seconds that a Poisson solve of a grid takes on this machine now."""
    x, y, z = (min(n, LARGEST_TIMED) for n in resolution)
    field = np.zeros((x, y, z), np.float32)
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        scipy.fft.idctn(scipy.fft.dctn(field, workers=2), workers=2)
        spent.append(time.perf_counter() - began)
    whole = resolution[0] * resolution[1] * resolution[2]
    return float(np.median(spent)) * whole / (x * y * z)
