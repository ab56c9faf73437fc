"""A hundred frames after a clip: does the smoke blow up, is its mass kept, and what does a frame cost?

    python -m benchmarks.direct.endurance SCENES/plume-3 ... [--frames 100]

Every scene is cut at two thirds and simulated on from its true densities and velocities. *Speed* is the largest in any
frame over the largest of the clip's last twelve. *Entered* and *left* are what the inlets put in and what the velocity
takes through the open sides, over the mass before; *balance* is the mass after all frames over what these leave one to
expect. *Mass* is that after all frames over that before, of the same smoke without inlets and dissipation in a box
whose sides are closed, where none may come or go. *Solves* is the processor time of a frame over that of one
projection, which is one Poisson solve.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.accuracy.scenes import baked_scene
from benchmarks.direct.clips import true_moment
from benchmarks.direct.continuation import largest_divergence
from benchmarks.tables import markdown
from smokelift.direct import Moment, Simulation, fit_simulation
from smokelift.direct.continuation import FITTED_MOMENTS
from smokelift.direct.inflow import Inflow
from smokelift.direct.physics import Physics
from smokelift.evaluation.truth import Truth
from smokelift.scene import SIDES
from smokelift.transport import Velocity, advect, project, without_divergence

HEADER = ["scene", "speed", "divergence", "entered", "left", "balance", "mass", "solves"]


def fastest(moment: Moment) -> float:
    """Return the largest speed on a face in m/s."""
    return max(float(np.abs(component).max()) for component in moment.velocity.faces)


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time of some work."""
    began = time.process_time()
    work()
    return time.process_time() - began


def sealed(simulation: Simulation, moment: Moment) -> tuple[Simulation, Moment]:
    """Return the same without inlets and dissipation, in a box whose sides are closed."""
    velocity = project(moment.velocity, closed=SIDES)
    start = Moment(moment.density, Velocity(velocity.faces, velocity.voxel_size, velocity.closed))
    nowhere = Inflow(np.zeros(moment.density.shape, bool), (start,))
    return replace(simulation, physics=Physics(simulation.physics.buoyancy, 0.0), inflow=nowhere), start


def entered(simulation: Simulation, before: Moment, after: Moment) -> float:
    """Return what the inlets put in from one moment to the next: what is in them over what the flow brought there."""
    inlets = simulation.inflow.voxels
    brought = advect(before.density, after.velocity, simulation.dt, conserve=True) * kept(simulation)
    return float((after.density - brought).sum(dtype=float, where=inlets))


def left_box(simulation: Simulation, before: Moment, after: Moment) -> float:
    """Return what the velocity takes through the open sides, at the mean of both densities beside them.

    Not what the simulation holds for gone: it follows the smoke of every voxel.
    """
    mean, left = (before.density + after.density) / 2, 0.0
    for axis, component in enumerate(after.velocity.faces):
        way = np.moveaxis(component, axis, 0) * simulation.dt / after.velocity.voxel_size
        for side, outwards in ((0, -way[0]), (-1, way[-1])):
            left += float((np.maximum(outwards, 0) * np.moveaxis(mean, axis, 0)[side]).sum(dtype=float))
    return left


def kept(simulation: Simulation) -> float:
    """Return the share of the smoke that does not dissolve in a step."""
    return math.exp(-simulation.physics.dissipation * simulation.dt)


def row(name: str, truth: Truth, frames: int) -> list[str]:
    """Return the figures of a scene."""
    cut = 2 * truth.frames // 3
    moments = [true_moment(truth, frame) for frame in range(max(1, cut - FITTED_MOMENTS), cut)]
    simulation, moment = fit_simulation(moments, truth.dt), moments[-1]
    solve = min(seconds(lambda: without_divergence(moments[-1].velocity)) for _ in range(3))
    fast, speed, divergence, spent = max(map(fastest, moments)), 0.0, 0.0, 0.0
    start = expected = float(moment.density.sum(dtype=float))
    came = gone = 0.0
    for step in range(1, frames + 1):
        began, before = time.process_time(), moment
        moment = simulation.next(moment, step)
        spent += time.process_time() - began
        speed, divergence = max(speed, fastest(moment)), max(divergence, largest_divergence(moment))
        more, less = entered(simulation, before, moment), left_box(simulation, before, moment)
        came, gone, expected = came + more, gone + less, kept(simulation) * expected + more - less
    balance = float(moment.density.sum(dtype=float)) / expected
    shut, moment = sealed(simulation, moments[-1])
    for step in range(1, frames + 1):
        moment = shut.next(moment, step)
    mass = moment.density.sum(dtype=float) / moments[-1].density.sum(dtype=float)
    flow = [f"{came / start:.2f}", f"{gone / start:.2f}", f"{balance:.3f}"]
    return [name, f"{speed / fast:.2f}", f"{divergence:.0e}", *flow, f"{mass:.5f}", f"{spent / frames / solve:.1f}"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--frames", type=int, default=100)
    options = parser.parse_args()
    rows = []
    for scene in options.scenes:
        truth = baked_scene(scene, 10**6).truth
        if truth is None:
            parser.error(f"{scene}: has no truth.npz")
        rows.append(row(scene.name, truth, options.frames))
        print(rows[-1], flush=True)
    print(markdown(HEADER, rows), flush=True)


if __name__ == "__main__":
    main()
