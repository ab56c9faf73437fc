"""A true plume set free, in wind, stirred, around a ball at rest and one that moves, as a picture.

python -m benchmarks.direct.reacting SCENES/plume-2 FILE.png [--frames 48]
"""

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from benchmarks.accuracy.scenes import baked_scene
from benchmarks.direct.clips import true_moment
from benchmarks.direct.continuation import tile
from benchmarks.truth.scenes import BOX_MIN, BOX_SIZE
from smokelift.checks.array_types import Mask
from smokelift.direct import Ball, Mesh, Turbulence, fit_simulation, spun_up
from smokelift.direct.surroundings import Obstacles, Surroundings
from smokelift.output.images import write_sheet
from smokelift.scene import Domain
from smokelift.transport import Array

LEARNT = range(8, 20)
"""Frames that the simulation learns from."""

HEIGHT, RADIUS = 1.55, 0.3
"""Height and radius of the ball, in meters; it stands above the middle of the smoke."""

WAY = 1.6
"""Meters that the moving ball goes, with its middle in the smoke's."""

POINTS = 400
"""Corners of the moving ball."""


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--frames", type=int, default=48)
    options = parser.parse_args()
    truth = baked_scene(options.scene).truth
    if truth is None:
        parser.error(f"{options.scene}: has no truth.npz")
    x0, y0, z0 = BOX_MIN
    domain = Domain(BOX_MIN, (x0 + BOX_SIZE[0], y0 + BOX_SIZE[1], z0 + BOX_SIZE[2]), truth.shape)
    moments = [true_moment(truth, frame) for frame in LEARNT]
    places = np.argwhere(moments[-1].density > 0) * truth.voxel_size
    weights = moments[-1].density[moments[-1].density > 0]
    x, y, _ = np.average(places, axis=0, weights=weights)
    middle = np.array([x0 + float(x), y0 + float(y), HEIGHT])
    ball, crossing = Ball(tuple(middle), RADIUS), through(middle, options.frames)
    cases = {
        "free": Surroundings(),
        "wind": Surroundings(wind=(0.8, 0.0, 0.0)),
        "turbulence": Surroundings(turbulences=(Turbulence(0.5, 0.4),)),
        "ball": Surroundings(obstacles=Obstacles(domain, (ball,))),
        "moving ball": Surroundings(obstacles=Obstacles(domain, (crossing,))),
    }
    shown = [max(1, options.frames * part // 6) for part in (1, 3, 6)]
    columns = {}
    for name, around in cases.items():
        simulation = fit_simulation(moments, truth.dt, surroundings=around)
        moment, kept = spun_up(simulation, moments), []
        for step in range(1, options.frames + 1):
            moment = simulation.next(moment, step)
            if step in shown:
                solid = around.solid(step, truth.dt)
                kept.append((moment.density, None if solid is None else solid.voxels))
        columns[name] = kept
    white = float(max(density.mean(axis=1).max() for density, _ in columns["free"]))
    rows = [[drawn(*columns[name][i], white) for name in cases] for i in range(3)]
    write_sheet(options.picture, rows, tuple(cases), [f"+{step}" for step in shown])


def through(middle: npt.NDArray[np.float64], frames: int) -> Mesh:
    """Return a ball that crosses the box from -x to +x through a point."""
    turns, heights = np.pi * (1 + 5**0.5) * np.arange(POINTS), 1 - (2 * np.arange(POINTS) + 1) / POINTS
    level = np.sqrt(1 - heights**2)
    points = np.stack([level * np.cos(turns), level * np.sin(turns), heights], axis=-1)
    corners = points[ConvexHull(points).simplices]
    inward = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) < 0
    corners[inward] = corners[inward, ::-1]
    ways = np.linspace(-WAY / 2, WAY / 2, frames + 1)
    places = np.stack([middle + np.array([way, 0, 0]) + RADIUS * corners for way in ways])
    return Mesh(places.astype(np.float32))


def drawn(density: Array, solid: Mask | None, white: float) -> npt.NDArray[np.uint8]:
    """Return a picture of smoke, with the mean of what is solid."""
    if solid is None:
        return tile(density, white)
    return tile(density + 0.4 * white / solid.mean(axis=1).max() * solid.astype(np.float32), white)


if __name__ == "__main__":
    main()
