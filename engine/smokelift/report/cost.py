"""What a run takes, known before it is spent: time, memory and disk.

It follows the voxels of the box, and more so those that may hold smoke. The time of frames is counted in Poisson solves
by cosine transforms, as long as one takes a voxel on this machine. What comes before the frames is not modelled: a
forecast prepares the shot as the run does, and that takes as long and as much memory again. How long it waited for the
processor is how busy the machine is. All constants: docs/experiments/memory-and-time.md.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import psutil
import scipy.fft

from smokelift.density.coarser_grid import MIN_COARSENED_VOXELS
from smokelift.report.workload import Workload

Resolution = tuple[int, int, int]

START_SECONDS = 1.5
"""Seconds of a processor to start and to measure the clip's texture."""

VOXELS_A_FRAME = 1.2e7
"""Voxels whose solve takes as long as what every frame takes, however small its grid: decoding and files."""

SOLVES_A_VOXEL = 12.0
"""Solves that take as long as what a frame takes for each voxel of the box."""

SOLVES_A_SMOKY_VOXEL = 250.0, 130.0
"""Solves that take as long as what a frame takes for each voxel that may hold smoke in addition: as many of them as are
fitted on their own grid, and those beyond, whose detail is found from coarse to fine."""

SHARE_A_VIEW = 0.5
"""Part of a frame's time that each further view adds."""

WITHOUT_DETAIL = 0.55
"""Part of a frame's time that is left without detail in depth."""

FRESH_FRAMES = 2.0
"""Frames that take as long as what the first two take in addition, for whose detail nothing is carried."""

PAPER_SOLVES = 1100.0
"""Solves that take as long as what a frame takes for each voxel by the paper's method."""

BYTES_A_SMOKY_VOXEL_ON_DISK = 16
"""Bytes of a density and three velocities at 16 bits, for each voxel that may hold smoke, and of the velocities around
it: 8.6 to 16 are usual."""

BASE_BYTES = 190 * 2**20
"""Bytes of memory for the interpreter, libraries and kernels."""

BYTES_A_PIXEL = 210
"""Bytes of memory for each pixel of the clips' frames: those that are decoded, and what was estimated from them."""

BYTES_A_VOXEL = 12, 380
"""Bytes at a run's peak for each voxel of the box, and for each that may hold smoke in addition."""

SMALL = 2**23
"""Voxels whose array takes 32 MiB. The C library gives smaller arrays of memory that it kept, which has to be cleared,
so that they take their memory whether smoke is there or not."""

BYTES_A_VOXEL_OF_SMALL = 80, 100
"""Bytes a voxel of such a grid, as `BYTES_A_VOXEL`."""

BYTES_A_VOXEL_OF_SOLVER = 145
"""Bytes for each voxel of the box that a velocity adds whose estimate has the grid of the density."""

TIMED, TIMES = (64, 64, 64), 9
"""Voxels of the grid whose solve is timed, and how often."""

BYTES_A_SIMULATED_VOXEL = 170
"""Bytes of memory at the peak for each voxel of a box in which smoke is simulated: 161 in one of 2.4 million with a
ball, less without an obstacle."""

MIN_VOXELS = 8
"""Voxels along the shortest side of a grid that is suggested."""


class NotEnoughMemoryError(MemoryError):
    """The grid does not fit; says which would."""


@dataclass(frozen=True)
class Cost:
    """What a run takes.

    Attributes
    ----------
    seconds
        Right to a factor of one and a half on a machine whose load does not change.
    memory, memory_free
        Bytes at the peak, and bytes that are free now.
    disk
        Bytes of the OpenVDB files, at most.
    """

    seconds: float
    memory: int
    memory_free: int
    disk: int


@dataclass(frozen=True)
class Spent:
    """What preparing a shot took.

    Attributes
    ----------
    seconds
        That passed.
    processor
        Seconds of all cores together.
    memory
        Bytes at the peak: of a large clip on a small grid as many as the run takes. None where that is not known.
    """

    seconds: float
    processor: float
    memory: int | None = None

    @property
    def wait(self) -> float:
        """Seconds that pass for each in which the process could work: 1 on a machine without other work."""
        return max(1.0, self.seconds / self.processor) if self.processor > 0 else 1.0


def estimate_cost(resolution: Resolution, work: Workload, prepared: Spent) -> Cost:
    """Estimate the cost of a run, whose shot took some time to be prepared; it takes a part of a second."""
    frames = START_SECONDS + voxel_solves(resolution, work) * _seconds_a_voxel()
    return Cost(
        seconds=prepared.seconds + prepared.wait * frames,
        memory=max(memory_needed(resolution, work), prepared.memory or 0),
        memory_free=memory_free(),
        disk=round(work.frames * work.mean * math.prod(resolution) * BYTES_A_SMOKY_VOXEL_ON_DISK),
    )


def voxel_solves(resolution: Resolution, work: Workload) -> float:
    """Return the voxels of Poisson solves that take as long as the frames of a run."""
    voxels = math.prod(resolution)
    if work.settings.method == "paper":
        return work.frames * PAPER_SOLVES * voxels
    on_own_grid, beyond = SOLVES_A_SMOKY_VOXEL
    smoky = work.mean * voxels
    fitted = on_own_grid * min(smoky, MIN_COARSENED_VOXELS) + beyond * max(smoky - MIN_COARSENED_VOXELS, 0)
    a_frame = (VOXELS_A_FRAME + SOLVES_A_VOXEL * voxels + fitted) * (1 + SHARE_A_VIEW * (work.views - 1))
    if work.settings.detail == 0:
        return work.frames * WITHOUT_DETAIL * a_frame
    return (work.frames + FRESH_FRAMES) * a_frame


def memory_needed(resolution: Resolution, work: Workload) -> int:
    """Return the bytes that a run takes at its peak."""
    voxels = math.prod(resolution)
    a_voxel, a_smoky_voxel = BYTES_A_VOXEL_OF_SMALL if voxels < SMALL else BYTES_A_VOXEL
    if work.settings.method == "paper" or work.settings.velocity.coarsening == 0:
        a_voxel += BYTES_A_VOXEL_OF_SOLVER
    return round(BASE_BYTES + BYTES_A_PIXEL * work.pixels + (a_voxel + work.largest * a_smoky_voxel) * voxels)


def affordable_room(resolution: Resolution) -> float:
    """Return how many times as large as a clip's box one may be whose simulation fits into the memory that is free."""
    return (memory_free() - BASE_BYTES) / (BYTES_A_SIMULATED_VOXEL * math.prod(resolution))


def memory_free() -> int:
    """Return the bytes that programs may still take."""
    return int(psutil.virtual_memory().available)


def peak_memory() -> int | None:
    """Return the peak of this process's memory in bytes; None where the system does not say.

    The maximum of `getrusage` would not do: in a child process it starts at the parent's.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except (OSError, UnicodeDecodeError):
        return None
    return next((1024 * int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")), None)


def require_memory(resolution: Resolution, work: Workload, *, given: bool = True) -> None:
    """Check that a run fits into the memory that is free.

    A box that is ``given`` keeps its proportions, so that voxels stay cubes; one that was found follows its voxels.

    Raises
    ------
    NotEnoughMemoryError
        With the largest resolution of the same shape that fits.
    """
    free = memory_free()
    needed = memory_needed(resolution, work)
    if needed <= free:
        return
    shape = " x ".join(map(str, resolution))
    smaller = _same_proportions(resolution) if given else _about_the_same(resolution)
    fits = next((each for each in smaller if memory_needed(each, work) <= free), None)
    advice = (
        f"the largest resolution that fits is {','.join(map(str, fits))}"
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
    return (each for each in candidates if min(each) >= MIN_VOXELS)


def _about_the_same(resolution: Resolution) -> Iterator[Resolution]:
    """Smaller resolutions of the same proportions but for multiples of four, the largest first."""
    for longest in range(max(resolution) - 4, 0, -4):
        x, y, z = (4 * math.ceil(n * longest / max(resolution) / 4) for n in resolution)
        if min(x, y, z) >= MIN_VOXELS:
            yield x, y, z


@cache
def _seconds_a_voxel() -> float:
    """Return the seconds that a Poisson solve takes on this machine, for each voxel; timed once, for all costs.

    The fastest of some is one that no other work held up.
    """
    field = np.zeros(TIMED, np.float32)
    spent = []
    for _ in range(TIMES):
        began = time.perf_counter()
        scipy.fft.idctn(scipy.fft.dctn(field, workers=2), workers=2)
        spent.append(time.perf_counter() - began)
    return min(spent) / field.size
