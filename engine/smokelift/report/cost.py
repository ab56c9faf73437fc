"""A forecast of what a run takes: time, memory and disk.

It follows the voxels of the box, and more so those that may hold smoke. The time of frames is counted in Poisson solves
by cosine transforms, which are timed on this machine. The set-up is not modelled: a forecast prepares the shot as the
run does, so the run takes that time and memory again. What other programs take meanwhile is left out: how busy the
machine is now does not say how busy it will be. Constants that say no other source:
docs/experiments/memory-and-time.md.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from statistics import fmean

import numpy as np
import psutil
import scipy.fft

from smokelift.density import RoundDepth, ViewSet
from smokelift.density.objective import MIN_COARSENED_VOXELS
from smokelift.setup.first_estimate import SAMPLE_FRAMES
from smokelift.setup.geometry import Shape, proportional
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot

START_SECONDS = 1.5
"""Processor seconds to start and to measure the clip's texture."""

FRAME_VOXELS = 1.2e7
"""A frame's time without its voxels (decoding and files), in voxels of a solve."""

VOXEL_SOLVES = 12.0
"""A frame's time for each voxel of the box, in solves."""

SMOKY_VOXEL_SOLVES = 250.0, 130.0
"""A frame's additional time for each voxel that may hold smoke, in solves: for those that are fitted on their own grid,
and for those beyond, whose detail is found from coarse to fine."""

VIEW_FRACTION = 0.5
"""Part of a frame's time that each further view adds."""

SMOOTH_FRACTION = 0.55
"""Part of a frame's time that is left without detail in depth."""

EXTRA_FRAMES = 2.0
"""Additional time of the first two frames, to whose detail none is carried, in frames."""

PAPER_VOXEL_SOLVES = 1100.0
"""A frame's time for each voxel by the paper's method, in solves."""

BYTES_PER_SMOKY_VOXEL_ON_DISK = 16
"""Bytes on disk for each voxel that may hold smoke: a density and three velocities at 16 bits, and velocities around.
8.6 to 16 are usual."""

BASE_BYTES = 190 * 2**20
"""Bytes of memory for the interpreter, libraries and kernels."""

BYTES_PER_PIXEL = 210
"""Bytes of memory for each pixel of the clips' frames: decoded frames and estimates from them."""

BYTES_PER_VOXEL = 12, 230
"""Bytes at a run's peak for each voxel of the box, and in addition for each that may hold smoke."""

SMALL_GRID_VOXELS = 2**23
"""Voxels whose array takes 32 MiB. Smaller arrays get memory that the C library kept and has to clear, so they take all
of it whether there is smoke or not."""

BYTES_PER_VOXEL_OF_SMALL_GRID = 80, 100
"""`BYTES_PER_VOXEL` of grids below `SMALL_GRID_VOXELS`."""

BYTES_PER_VOXEL_OF_SOLVER = 145
"""Bytes for each voxel of the box that a velocity on the density's grid adds."""

TIMED_GRID, TIMED_SOLVES = (64, 64, 64), 40
"""Voxels of the grid whose solve is timed, and how often: the processor's clock of some systems counts in 16 ms."""

WORKERS = 2
"""Threads that a forecast assumes to share the processor time of a solve, whatever a run may use: times were measured
on two cores (by hand)."""

BYTES_PER_SIMULATED_VOXEL = 170
"""Bytes at the peak for each voxel of a box in which smoke is simulated (measured: 161 in one of 2.4 million with a
ball, less without an obstacle)."""

MIN_VOXELS = 8
"""Smallest number of voxels along the shortest side of a suggested grid (by hand)."""

MAX_SIDE_VOXELS = 96
"""Largest number of voxels along a side of the grid that smoke is measured on. A rim of one voxel counts with it, which
makes fractions up to two fifths too large."""

MEASURED_FRAMES = 4
"""Largest number of frames with smoke that are measured, from the one with the most on (by hand)."""


class NotEnoughMemoryError(MemoryError):
    """The grid does not fit into memory; the message says which would."""


@dataclass(frozen=True)
class Workload:
    """What decides how much a run takes, besides the resolution."""

    settings: Settings
    """The given ones: a velocity's grid that is chosen is coarse, and hardly takes memory."""
    frames: int
    views: int
    pixels: int
    """Numbers: of frames, of cameras, and of pixels in all cameras' pictures of one moment."""
    smoky_max: float
    smoky_mean: float
    """Fractions of the box's voxels that may hold smoke: in the frame with the most of it, and on the mean of all."""
    prepared: float = 0.0
    """Seconds that preparing the shot took, without what it waited for a processor; a run prepares it again."""
    peak: int = 0
    """Bytes of memory at the peak of that, 0 if unknown. For a large clip on a small grid it is as much as the
    run's."""

    @staticmethod
    def of(shot: Shot, settings: Settings, began: tuple[float, float]) -> "Workload":
        """Measure a shot that was prepared with settings from a `moment` on."""
        fractions = _smoky_fractions(shot, settings)
        smoky = len(shot.smoky) / len(shot.spread(SAMPLE_FRAMES))
        return Workload(
            settings=settings,
            frames=shot.length,
            views=len(shot.views),
            pixels=sum(width * height for width, height in (view.clip.size for view in shot.views)),
            smoky_max=max(fractions, default=0.0),
            smoky_mean=smoky * fmean(fractions) if fractions else 0.0,
            prepared=min(now - then for now, then in zip(moment(), began, strict=True)),
            peak=peak_memory() or 0,
        )


@dataclass(frozen=True)
class Cost:
    """What a run takes: seconds, bytes of memory at its peak, and at most so many bytes of OpenVDB files.

    The seconds are right to a factor of 1.5 on a machine without other work. ``memory_free`` is bytes now.
    """

    seconds: float
    memory: int
    memory_free: int
    disk: int


def moment() -> tuple[float, float]:
    """Return the time in seconds, and the processor time of all cores together that this process has taken."""
    return time.monotonic(), time.process_time()


def estimate_cost(resolution: Shape, work: Workload) -> Cost:
    """Estimate the cost of a run from its grid, its smoke and what preparing it took, in a part of a second."""
    return Cost(
        seconds=work.prepared + frames_seconds(resolution, work),
        memory=max(memory_needed(resolution, work), work.peak),
        memory_free=memory_free(),
        disk=round(work.frames * work.smoky_mean * math.prod(resolution) * BYTES_PER_SMOKY_VOXEL_ON_DISK),
    )


def frames_seconds(resolution: Shape, work: Workload) -> float:
    """Estimate the seconds of a run's frames, without the set-up, in a part of a second."""
    return START_SECONDS + voxel_solves(resolution, work) * _seconds_per_voxel()


def voxel_solves(resolution: Shape, work: Workload) -> float:
    """Return the time of a run's frames, in voxels of Poisson solves."""
    voxels = math.prod(resolution)
    if work.settings.method == "paper":
        return work.frames * PAPER_VOXEL_SOLVES * voxels
    on_own_grid, beyond = SMOKY_VOXEL_SOLVES
    smoky = work.smoky_mean * voxels
    fitted = on_own_grid * min(smoky, MIN_COARSENED_VOXELS) + beyond * max(smoky - MIN_COARSENED_VOXELS, 0)
    per_frame = (FRAME_VOXELS + VOXEL_SOLVES * voxels + fitted) * (1 + VIEW_FRACTION * (work.views - 1))
    if work.settings.detail == 0:
        return work.frames * SMOOTH_FRACTION * per_frame
    return (work.frames + EXTRA_FRAMES) * per_frame


def memory_needed(resolution: Shape, work: Workload) -> int:
    """Return the bytes that a run takes at its peak."""
    voxels = math.prod(resolution)
    per_voxel, per_smoky_voxel = BYTES_PER_VOXEL_OF_SMALL_GRID if voxels < SMALL_GRID_VOXELS else BYTES_PER_VOXEL
    coarsening = work.settings.velocity.coarsening
    # one that is not given is chosen, unless nothing is measured: then it is 0
    on_own_grid = not work.settings.measure if coarsening is None else coarsening == 0
    if work.settings.method == "paper" or on_own_grid:
        per_voxel += BYTES_PER_VOXEL_OF_SOLVER
    return round(BASE_BYTES + BYTES_PER_PIXEL * work.pixels + (per_voxel + work.smoky_max * per_smoky_voxel) * voxels)


def affordable_room(resolution: Shape) -> float:
    """Return how many times as large as a clip's box a simulated one may be to fit into the free memory."""
    return (memory_free() - BASE_BYTES) / (BYTES_PER_SIMULATED_VOXEL * math.prod(resolution))


def memory_free() -> int:
    """Return the bytes that programs may still take."""
    return int(psutil.virtual_memory().available)


def peak_memory() -> int | None:
    """Return the peak of this process's memory in bytes; None if the system does not say.

    `getrusage` will not do: in a child process its maximum starts at the parent's.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    return next((1024 * int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")), None)


def require_memory(resolution: Shape, work: Workload, *, given: bool = True) -> None:
    """Check that a run fits into the free memory; NotEnoughMemoryError with the largest resolution that does.

    A ``given`` box keeps its proportions, so that voxels stay cubes; one that was found follows its voxels.
    """
    free = memory_free()
    needed = memory_needed(resolution, work)
    if needed <= free:
        return
    shape = " x ".join(map(str, resolution))
    smaller = reversed(proportional(resolution, 1, max(resolution) - 1)) if given else _about_the_same(resolution)
    fits = next((each for each in smaller if min(each) >= MIN_VOXELS and memory_needed(each, work) <= free), None)
    advice = (
        f"the largest resolution that fits is {','.join(map(str, fits))}"
        if fits
        else "close other programs; no grid of this shape fits"
    )
    raise NotEnoughMemoryError(
        f"{shape} voxels need about {needed / 2**30:.1f} GiB of memory and {free / 2**30:.1f} GiB are free; {advice}."
    )


def _about_the_same(resolution: Shape) -> Iterator[Shape]:
    """Smaller resolutions of about the same proportions in multiples of four, the largest first."""
    for longest in range(max(resolution) - 4, 0, -4):
        x, y, z = (4 * math.ceil(n * longest / max(resolution) / 4) for n in resolution)
        yield x, y, z


def _smoky_fractions(shot: Shot, settings: Settings) -> list[float]:
    """Fractions of the voxels that may hold smoke, in some of the frames with smoke, on a coarse grid."""
    if settings.method == "paper":  # its densities are anywhere in the box
        return [1.0]
    optics = replace(shot.optics, domain=shot.optics.domain.with_at_most(MAX_SIDE_VOXELS))
    prior = RoundDepth().of_clip(shot)
    step = -(-len(shot.smoky) // MEASURED_FRAMES) or 1
    moments = ((frame, shot.observe(frame)) for frame in shot.smoky[::step])
    seen = [ViewSet.of(observations, optics, frame) for frame, observations in moments if observations]
    return [float(prior.estimate(views).views.hull.mean()) for views in seen]


@cache
def _seconds_per_voxel() -> float:
    """Return the seconds that a Poisson solve takes on this machine for each voxel; timed once."""
    field = np.zeros(TIMED_GRID, np.float32)
    scipy.fft.idctn(scipy.fft.dctn(field))  # the first finds nothing in the caches
    began = time.process_time()  # while other programs, or a run of our own, are at work, up to thrice as much passes
    for _ in range(TIMED_SOLVES):
        scipy.fft.idctn(scipy.fft.dctn(field))  # on one thread: a system may allow no more
    return (time.process_time() - began) / (WORKERS * TIMED_SOLVES * field.size)
