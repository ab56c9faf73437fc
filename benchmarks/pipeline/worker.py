"""One run of the pipeline in a process of its own, so that its peak of memory is its own.

    python -m benchmarks.pipeline.worker SCENE.toml XxYxZ METHOD QUALITY FRAMES FOLDER

writes run.json into the folder.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from benchmarks.machine import peak_bytes, poisson_seconds
from benchmarks.process import run_module, why_it_ended
from benchmarks.tables import size_text
from smokelift.footage.clip import Clip
from smokelift.pipeline import reconstruct
from smokelift.scene import Scene
from smokelift.setup.settings import Method, Quality, Settings

STARTED = 2
"""Frames that are not clocked: the first two come together, and compilers work before them."""


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
        A frame: all of it, from its picture (the paper's rendering), and its velocity.
    solves
        The whole frame in Poisson solves.
    memory_mib
        Peak of the process; None where the system does not say.
    psnr
        Of the working picture, linear, mean over the frames (dB).
    failure
        One sentence if there is nothing else.
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
    scene_path: Path, shape: tuple[int, int, int], method: Method, quality: Quality, frames: int, folder: Path
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


def measure(scene_path: Path, shape: tuple[int, int, int], method: Method, quality: Quality, frames: int) -> Run:
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
    source = replace(scene.clip, frames=(first, first + STARTED + frames - 1))
    settings = Settings.preset(quality, method, shape)
    seconds, units, density, velocity, psnr = [], [], [], [], []
    with tempfile.TemporaryDirectory() as out, Clip.open(source) as clip:
        began = time.perf_counter()
        for frame in reconstruct(clip, scene, settings, Path(out) / "smoke"):
            seconds.append(time.perf_counter() - began)
            units.append(poisson_seconds(shape))
            density.append(frame.figures["seconds_density"])
            velocity.append(frame.figures["seconds_velocity"])
            psnr.append(frame.figures["psnr"])
            began = time.perf_counter()
    whole, rendering, motion = (float(np.median(values[STARTED:])) for values in (seconds, density, velocity))
    peak = peak_bytes()
    return Run(
        size=shape,
        method=method,
        seconds=whole,
        seconds_density=rendering,
        seconds_velocity=motion,
        solves=whole / float(np.median(units[STARTED:])),
        memory_mib=None if peak is None else peak / 2**20,
        psnr=float(np.mean(psnr[STARTED:])),
    )


def main() -> None:
    """Do what the command line says."""
    scene_path, size, method, quality, frames, folder = sys.argv[1:]
    x, y, z = (int(count) for count in size.split("x"))
    try:
        found = measure(Path(scene_path), (x, y, z), cast(Method, method), cast(Quality, quality), int(frames))
    except MemoryError as error:
        found = Run((x, y, z), method, failure=str(error) or "Out of memory.")
    except ValueError as error:
        found = Run((x, y, z), method, failure=str(error))
    (Path(folder) / "run.json").write_text(json.dumps(asdict(found)))


if __name__ == "__main__":
    main()
