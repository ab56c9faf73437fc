"""One run of the pipeline in a process of its own, so that its peak of memory is its own."""

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import UNTIMED, FrameTimes, median, peak_mib
from benchmarks.process import apart
from smokelift.footage.clip import Clip
from smokelift.pipeline import reconstruct
from smokelift.scene import Scene
from smokelift.setup.settings import Settings

CLOCKS = {"wall": time.perf_counter, "processor": time.process_time}
"""What a user waits; and the work of all cores, which is the same beside other work."""


@dataclass(frozen=True)
class Run:
    """What a run took. Times are medians over the frames.

    Attributes
    ----------
    size
        Voxels along x, y and z.
    seconds, seconds_density, seconds_velocity
        A whole frame, its density (the paper's rendering) and its velocity.
    solves
        The whole frame in Poisson solves of the same grid.
    memory_mib
        Peak of the process's memory; None where the system does not say.
    psnr
        Of the working picture, linear, mean over the frames (dB).
    occupied
        Fraction of the voxels that may hold smoke, mean over the frames.
    failure
        Why there are no figures, one sentence; else empty.
    """

    size: tuple[int, int, int]
    seconds: float = 0.0
    seconds_density: float = 0.0
    seconds_velocity: float = 0.0
    solves: float = 0.0
    memory_mib: float | None = None
    psnr: float = 0.0
    occupied: float = 0.0
    failure: str = ""


def run_apart(path: Path, settings: Settings, size: tuple[int, int, int], frames: int, clock: str) -> Run:
    """Measure in a process of its own."""
    found = apart(measure, path, settings, size, frames, clock)
    return Run(size, failure=found) if isinstance(found, str) else found


def measure(path: Path, settings: Settings, size: tuple[int, int, int], frames: int, clock: str) -> Run:
    """Reconstruct in this process the clip of a scene file on a grid, and time some frames by a clock of `CLOCKS`.

    Raises
    ------
    ValueError
        If the scene, its clip or the resolution cannot be used.
    """
    scene = Scene.load(path)
    if scene.clip is None:
        raise ValueError(f"{path}: has no [clip].")
    source = replace(scene.clip, frames=(0, UNTIMED + frames - 1))
    times = FrameTimes(size, CLOCKS[clock])
    with tempfile.TemporaryDirectory() as out, Clip.open(source) as clip:
        figures: list[Mapping[str, Any]] = []
        run = reconstruct(clip, scene, replace(settings, resolution=size))
        run.write(Path(out) / "smoke", on_frame=times.before(lambda frame: figures.append(frame.figures)))
    return Run(
        size=size,
        seconds=times.seconds,
        seconds_density=median([found["seconds_density"] for found in figures]),
        seconds_velocity=median([found["seconds_velocity"] for found in figures]),
        solves=times.solves,
        memory_mib=peak_mib(),
        psnr=float(np.mean([found["psnr_working"] for found in figures[UNTIMED:]])),
        occupied=float(np.mean([found["hull_share"] for found in figures[UNTIMED:]])),
    )
