"""A true plume set free, around a ball and in wind, as a picture.

python -m benchmarks.direct.reacting SCENES/plume-2 FILE.png [--frames 48]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.accuracy.scenes import baked_scene
from benchmarks.direct.clips import true_moment
from benchmarks.direct.continuation import tile
from benchmarks.truth.scenes import BOX_MIN, BOX_SIZE
from smokelift.direct import Ball, learnt_simulation
from smokelift.direct.obstacles import Obstacles
from smokelift.direct.surroundings import Surroundings
from smokelift.output.sheet import write_sheet
from smokelift.scene import Domain

LEARNT = range(8, 20)
"""Frames that the simulation learns from."""

HEIGHT, RADIUS = 1.55, 0.3
"""Of the ball, in metres; it stands above the middle of the smoke."""


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--frames", type=int, default=48)
    options = parser.parse_args()
    truth = baked_scene(options.scene, 10**6).truth
    if truth is None:
        parser.error(f"{options.scene}: has no truth.npz")
    x0, y0, z0 = BOX_MIN
    domain = Domain(BOX_MIN, (x0 + BOX_SIZE[0], y0 + BOX_SIZE[1], z0 + BOX_SIZE[2]), truth.shape)
    moments = [true_moment(truth, frame) for frame in LEARNT]
    places = np.argwhere(moments[-1].density > 0) * truth.voxel_size
    weights = moments[-1].density[moments[-1].density > 0]
    x, y, _ = np.average(places, axis=0, weights=weights)
    ball = Ball((x0 + float(x), y0 + float(y), HEIGHT), RADIUS)
    solid = ball.voxels(domain)
    cases = {
        "free": Surroundings(),
        "ball": Surroundings(obstacles=Obstacles(domain, (ball,))),
        "wind": Surroundings(wind=(0.8, 0.0, 0.0)),
    }
    shown = [max(1, options.frames * part // 6) for part in (1, 3, 6)]
    columns = {}
    for name, around in cases.items():
        simulation, moment, kept = learnt_simulation(moments, truth.dt, surroundings=around), moments[-1], []
        for step in range(1, options.frames + 1):
            moment = simulation.next(moment, step)
            if step in shown:
                kept.append(moment.density)
        columns[name] = kept
    white = float(max(density.mean(axis=1).max() for density in columns["free"]))
    drawn = 0.4 * white / solid.mean(axis=1).max() * solid.astype(np.float32)
    rows = [[tile(columns[name][i] + (drawn if name == "ball" else 0), white) for name in cases] for i in range(3)]
    write_sheet(options.picture, rows, tuple(cases), [f"+{step}" for step in shown])


if __name__ == "__main__":
    main()
