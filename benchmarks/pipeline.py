"""Seconds a frame of the whole run, in units of one cosine-transform Poisson solve of the same grid, and peak memory.

    python benchmarks/pipeline.py scene.toml [--quality balanced] [--method default] [--frames A:B]

From decoding the clip to files on disk. The unit is measured in the same run, between the frames: scipy.fft.dctn there
and idctn back, float32, two workers.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import smokelift
from smokelift.bench.machine import poisson_seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--quality", default="balanced")
    parser.add_argument("--method", default="default")
    parser.add_argument("--frames", type=lambda text: tuple(map(int, text.split(":"))))
    options = parser.parse_args()
    scene = smokelift.Scene.load(options.scene)
    source = scene.clip if options.frames is None else replace(scene.clip, frames=options.frames)
    settings = smokelift.Settings.preset(options.quality, options.method)
    seconds, units, fits = [], [], []
    with tempfile.TemporaryDirectory() as folder, smokelift.Clip.open(source) as clip:
        began = time.perf_counter()
        for frame in smokelift.reconstruct(clip, scene, settings, Path(folder) / "out"):
            seconds.append(time.perf_counter() - began)
            units.append(poisson_seconds(frame.density.shape))
            if frame.figures["hull_share"] > 0:
                fits.append(frame.figures["psnr"])
            began = time.perf_counter()
    # the first two come together, after the preparation of the shot
    seconds, units = seconds[2:], units[2:]
    unit = float(np.median(units))
    median = float(np.median(seconds))
    print(f"{len(seconds)} frames of {' x '.join(map(str, frame.density.shape))} voxels")
    print(
        f"median {median:.2f} s a frame (from {min(seconds):.2f} to {max(seconds):.2f}), mean {np.mean(seconds):.2f} s"
    )
    print(f"Poisson solve {1e3 * unit:.1f} ms; a frame is {median / unit:.0f} of them")
    print(f"input view {np.mean(fits):.1f} dB over {len(fits)} frames with smoke")
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")


if __name__ == "__main__":
    main()
