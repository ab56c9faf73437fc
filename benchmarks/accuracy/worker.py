"""One run of the accuracy benchmark in a process of its own, so that its peak of memory is its own.

Only the reconstruction is timed, from decoding the clip to OpenVDB files on disk, not the writing of the arrays. Times
are the processor's, over all cores, so that other work on the machine changes none.
"""

import itertools
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.accuracy.runs import SMEAR, further_view, run_method, run_settings, run_views, smeared
from benchmarks.machine import FrameTimes, peak_mib
from smokelift import Clip, Reconstruction, Scene, Settings, prepare_shot
from smokelift.render import Volume


def reconstruct(scene_path: Path, run: str, frames: tuple[int, int], out: Path) -> None:
    """Reconstruct a clip's frames from the first to the last, with the further views that a run names, into a folder.

    It gets 0001.npz, ... (density, and the velocity at voxel centers in m/s if the run has one), scene.toml with what
    was estimated, and run.json.
    """
    scene = Scene.load(scene_path)
    if scene.clip is None:
        raise ValueError(f"{scene_path}: has no [clip].")
    source = replace(scene.clip, frames=frames)
    settings = Settings.preset() if run == SMEAR else run_settings(run)
    with tempfile.TemporaryDirectory() as folder, Clip.open(source) as clip:
        views = tuple(further_view(name, scene_path, frames[1], Path(folder)) for name in run_views(run))
        scene = replace(scene, views=views)
        shot = prepare_shot(clip, scene, settings)
        shot.scene.save(out / "scene.toml")
        shape = shot.scene.domain.resolution
        times = FrameTimes(shape, time.process_time)
        if run == SMEAR:
            numbers = itertools.count(1)

            def save(density: Volume) -> None:
                np.savez(out / f"{next(numbers):04d}.npz", density=density)

            keep = times.before(save)
            for density in smeared(shot):
                keep(density)
        else:
            reconstruction = Reconstruction(shot, run_method(run, shot.settings))
            reconstruction.write(
                Path(folder) / "smoke",
                on_frame=times.before(
                    lambda frame: np.savez(
                        out / f"{frame.number:04d}.npz", density=frame.density, velocity=frame.velocity.centres()
                    )
                ),
            )
    result = {
        "frames": shot.length,
        "seconds": times.seconds,
        "solves": times.solves,
        "memory_mib": peak_mib(),
        "scattering": shot.scene.scattering,
        "resolution": list(shape),
        "method": "baseline" if run == SMEAR else settings.method,
    }
    (out / "run.json").write_text(json.dumps(result) + "\n")
