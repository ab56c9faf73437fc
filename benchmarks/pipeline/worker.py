"""One run of the pipeline in a process of its own, so that its peak of memory is its own.

    python -m benchmarks.pipeline.worker SCENE.toml XxYxZ METHOD QUALITY FRAMES FOLDER

writes run.json into the folder.
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from benchmarks.machine import peak_mib
from benchmarks.process import run_module, why_it_ended
from benchmarks.tables import size_text
from benchmarks.timing import UNTIMED, FrameTimes, median
from smokelift.footage.clip import Clip
from smokelift.pipeline import reconstruct
from smokelift.scene import Scene
from smokelift.setup.settings import MethodName, Quality, Settings


@dataclass(frozen=True)
class Run:
    """What a run took. Times are medians over the frames.

    Attributes
    ----------
    size
        Voxels along x, y and z.
    method
        As in `Settings`.
    seconds, seconds_density, seconds_velocity
        A whole frame, its density (the paper's rendering) and its velocity.
    solves
        The whole frame in Poisson solves of the same grid.
    memory_mib
        Peak of the process's memory; None where the system does not say.
    psnr
        Of the working picture, linear, mean over the frames (dB).
    failure
        Why there are no figures, one sentence; else empty.
    """

    size: tuple[int, ...]
    method: str
    seconds: float = 0.0
    seconds_density: float = 0.0
    seconds_velocity: float = 0.0
    solves: float = 0.0
    memory_mib: float | None = None
    psnr: float = 0.0
    failure: str = ""


def run_apart(
    scene_path: Path, shape: tuple[int, int, int], method: MethodName, quality: Quality, frames: int, folder: Path
) -> Run:
    """Time a run in a process of its own."""
    result = folder / "run.json"
    result.unlink(missing_ok=True)
    ended = run_module(
        "benchmarks.pipeline.worker", str(scene_path), size_text(shape), method, quality, str(frames), str(folder)
    )
    if result.exists():
        return Run(**json.loads(result.read_text()))
    return Run(shape, method, failure=why_it_ended(ended))


def measure(scene_path: Path, shape: tuple[int, int, int], method: MethodName, quality: Quality, frames: int) -> Run:
    """Time a run in this process.

    Raises
    ------
    ValueError
        If the scene, its clip or the resolution cannot be used.
    """
    scene = Scene.load(scene_path)
    if scene.clip is None:
        raise ValueError(f"{scene_path}: has no [clip]; give the path of the video there.")
    first = scene.clip.frames[0] if scene.clip.frames is not None else 0
    source = replace(scene.clip, frames=(first, first + UNTIMED + frames - 1))
    settings = Settings.preset(quality, method, shape)
    times = FrameTimes(shape)
    with tempfile.TemporaryDirectory() as out, Clip.open(source) as clip:
        figures = [frame.figures for frame in times.over(reconstruct(clip, scene, settings, Path(out) / "smoke"))]
    return Run(
        size=shape,
        method=method,
        seconds=times.seconds,
        seconds_density=median([found["seconds_density"] for found in figures]),
        seconds_velocity=median([found["seconds_velocity"] for found in figures]),
        solves=times.solves,
        memory_mib=peak_mib(),
        psnr=float(np.mean([found["psnr"] for found in figures[UNTIMED:]])),
    )


def main() -> None:
    """Do the run that the command line names."""
    scene_path, size, method, quality, frames, folder = sys.argv[1:]
    x, y, z = (int(count) for count in size.split("x"))
    try:
        found = measure(Path(scene_path), (x, y, z), cast(MethodName, method), cast(Quality, quality), int(frames))
    except MemoryError as error:
        found = Run((x, y, z), method, failure=str(error) or "Out of memory.")
    except ValueError as error:
        found = Run((x, y, z), method, failure=str(error))
    (Path(folder) / "run.json").write_text(json.dumps(asdict(found)))


if __name__ == "__main__":
    main()
