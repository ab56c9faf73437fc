"""One run of the pipeline in a process of its own, so that its peak of memory is its own.

    python -m benchmarks.pipeline.worker JOB FOLDER

reads the job, a `Job` as JSON, and writes run.json into the folder.
"""

import json
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.machine import UNTIMED, FrameTimes, median, peak_mib
from benchmarks.process import run_module, why_it_ended
from smokelift.footage.clip import Clip
from smokelift.pipeline import reconstruct
from smokelift.scene import Scene
from smokelift.setup.settings import Quality, Settings

CLOCKS = {"wall": time.perf_counter, "processor": time.process_time}
"""What a user waits; and the work of all cores, which is the same beside other work."""


@dataclass(frozen=True)
class Job:
    """What is run.

    Attributes
    ----------
    scene
        Path of a scene file with a clip.
    size
        Voxels along x, y and z.
    quality, detail
        As in `Settings`.
    frames
        How many are timed.
    clock
        Name in `CLOCKS`.
    """

    scene: str
    size: tuple[int, int, int]
    quality: Quality
    detail: float
    frames: int
    clock: Literal["wall", "processor"]


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


def run_apart(job: Job, folder: Path) -> Run:
    """Do a job in a process of its own, which leaves its result in a folder."""
    result = folder / "run.json"
    result.unlink(missing_ok=True)
    ended = run_module("benchmarks.pipeline.worker", json.dumps(asdict(job)), str(folder))
    if result.exists():
        found = json.loads(result.read_text())
        return Run(**{**found, "size": tuple(found["size"])})
    return Run(job.size, failure=why_it_ended(ended))


def measure(job: Job) -> Run:
    """Do a job in this process.

    Raises
    ------
    ValueError
        If the scene, its clip or the resolution cannot be used.
    """
    scene = Scene.load(job.scene)
    if scene.clip is None:
        raise ValueError(f"{job.scene}: has no [clip].")
    source = replace(scene.clip, frames=(0, UNTIMED + job.frames - 1))
    settings = replace(Settings.preset(job.quality, resolution=job.size), detail=job.detail)
    times = FrameTimes(job.size, CLOCKS[job.clock])
    with tempfile.TemporaryDirectory() as out, Clip.open(source) as clip:
        figures: list[Mapping[str, Any]] = []
        run = reconstruct(clip, scene, settings)
        run.write(Path(out) / "smoke", on_frame=times.before(lambda frame: figures.append(frame.figures)))
    return Run(
        size=job.size,
        seconds=times.seconds,
        seconds_density=median([found["seconds_density"] for found in figures]),
        seconds_velocity=median([found["seconds_velocity"] for found in figures]),
        solves=times.solves,
        memory_mib=peak_mib(),
        psnr=float(np.mean([found["psnr_working"] for found in figures[UNTIMED:]])),
        occupied=float(np.mean([found["hull_share"] for found in figures[UNTIMED:]])),
    )


def main() -> None:
    """Do the job that the command line names."""
    words = json.loads(sys.argv[1])
    job = Job(**{**words, "size": tuple(words["size"])})
    try:
        found = measure(job)
    except MemoryError as error:
        found = Run(job.size, failure=str(error) or "Out of memory.")
    except ValueError as error:
        found = Run(job.size, failure=str(error))
    (Path(sys.argv[2]) / "run.json").write_text(json.dumps(asdict(found)))


if __name__ == "__main__":
    main()
