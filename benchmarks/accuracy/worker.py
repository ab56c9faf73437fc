"""One run of the accuracy benchmark in a process of its own, so that its peak of memory is its own.

    python -m benchmarks.accuracy.worker scene.toml RUN FIRST LAST OUT

reads the clip's frames FIRST to LAST (and those of further views that RUN names). It writes OUT/0001.npz, ... (density,
and the velocity at voxel centres in m/s if the run has one), OUT/scene.toml with what was estimated, and OUT/run.json.
Only the reconstruction is timed, from decoding the clip to OpenVDB files on disk, not the writing of the arrays. Times
are the processor's, over all cores, so that other work on the machine changes none.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.accuracy.runs import SMEAR, further_view, run_method, run_settings, run_views, smeared
from benchmarks.machine import peak_mib
from benchmarks.timing import FrameTimes
from smokelift import Clip, Scene, Settings, reconstruct
from smokelift.setup.prepare import prepare_shot
from smokelift.transport import Array


def main() -> None:
    """Do the run that the command line names."""
    scene_path, run, first, last, out = (Path(sys.argv[1]), *sys.argv[2:5], Path(sys.argv[5]))
    scene = Scene.load(scene_path)
    if scene.clip is None:
        raise ValueError(f"{scene_path}: has no [clip].")
    source = replace(scene.clip, frames=(int(first), int(last)))
    settings = Settings.preset() if run == SMEAR else run_settings(run)
    with tempfile.TemporaryDirectory() as folder, Clip.open(source) as clip:
        views = tuple(further_view(name, scene_path, int(last), Path(folder)) for name in run_views(run))
        scene = replace(scene, views=views)
        shot = prepare_shot(clip, scene, settings)
        shot.scene.save(out / "scene.toml")
        if run == SMEAR:
            found: Iterator[dict[str, Array]] = ({"density": density} for density in smeared(shot))
        else:
            frames = reconstruct(
                clip, scene, out=Path(folder) / "smoke", shot=shot, method=run_method(run, shot.settings)
            )
            found = ({"density": frame.density, "velocity": frame.velocity.centres()} for frame in frames)
        shape = shot.scene.domain.resolution
        times = FrameTimes(shape, time.process_time)
        for number, arrays in enumerate(times.over(found), 1):
            np.savez(out / f"{number:04d}.npz", **arrays)
    result = {
        "frames": number,
        "seconds": times.seconds,
        "solves": times.solves,
        "memory_mib": peak_mib(),
        "scattering": shot.scene.scattering,
        "resolution": list(shape),
        "method": "baseline" if run == SMEAR else settings.method,
    }
    (out / "run.json").write_text(json.dumps(result) + "\n")


if __name__ == "__main__":
    main()
