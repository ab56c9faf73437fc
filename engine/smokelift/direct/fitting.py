"""A simulation fitted to a clip's last moments: its forces, its inlets, and a velocity that these forces explain.

An estimated velocity is smooth and slow: it explains how the smoke moved, but lacks the eddies that draw it out next. A
simulation that starts from it makes threads. So the simulation runs along the clip first. It takes the velocity from
the first moment alone, and at each moment the clip's density (direct insertion: Charney, Halem and Jastrow, "Use of
incomplete historical data to infer the present state of the atmosphere", 1969). The density's detail turns the air
around it, so that eddies come in on every scale that the clip shows.

The buoyancy is the one with which smoke rises as it does in the clip. A velocity's change from one moment to the next
does not tell it, since estimates err by more than that. How far the smoke rises in half of the moments does
(docs/experiments/continuation.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from smokelift.checks.array_types import Mask
from smokelift.direct.burning import fit_fire
from smokelift.direct.inflow import Inflow, find_inflow
from smokelift.direct.moment import Moment
from smokelift.direct.simulation import Physics, Simulation
from smokelift.direct.surroundings import Surroundings
from smokelift.transport import Array, Velocity, advect
from smokelift.velocity.pyramid import coarsen, coarsen_faces

COARSE = 64
"""Voxels along the longest side, at most, of the grid that the buoyancy is fitted on: a centre needs no more."""

MIN_MOMENTS = 8
"""Moments that show a buoyancy, at least: over fewer one of 1 m/s2 moves the smoke's centre by less than a tenth of a
voxel, which is within its error."""

TRIALS = 6
"""Steps of the secant method at most: the centre's height is nearly linear in the buoyancy."""

MIN_HEIGHT_DIFFERENCE = 1e-6
"""Voxels of difference in height, at most, that are rounding."""

PRECISION = 0.01
"""Relative change of the buoyancy below which it is found."""


def fit_simulation(
    moments: Sequence[Moment], dt: float, marked: Mask | None = None, surroundings: Surroundings | None = None
) -> Simulation:
    """Fit forces, inlets and fire to the moments of a clip, for a simulation that goes on from them.

    The moments are consecutive, two at least, `dt` seconds apart. Where smoke enters is marked (nx, ny, nz), if that is
    known.
    """
    inflow = find_inflow(moments, dt, marked)
    dissipation = _dissipation(moments, dt, inflow.voxels)
    physics = Physics(_buoyancy(moments, dt, inflow.voxels, dissipation), dissipation)
    return Simulation(physics, inflow.cropped(), surroundings or Surroundings(), dt, fit_fire(moments, dt))


def spun_up(simulation: Simulation, moments: Sequence[Moment]) -> Moment:
    """The last of some consecutive moments, with the velocity that the forces have made since the first.

    The simulation is fitted to them; what is placed around the smoke does not act yet.
    """
    return _spun_up(_along(simulation), moments)


def _along(simulation: Simulation) -> Simulation:
    """The simulation of the clip itself: step n goes to moment n, and what entered then enters."""
    return replace(simulation, inflow=simulation.inflow.forwards(), surroundings=Surroundings(), fire=None)


def _spun_up(along: Simulation, moments: Sequence[Moment]) -> Moment:
    velocity = moments[0].velocity
    for step, moment in enumerate(moments[:-1], 1):
        velocity = along.velocity(replace(moment, velocity=velocity), step)
    return replace(moments[-1], velocity=velocity)


def _buoyancy(moments: Sequence[Moment], dt: float, inlets: Mask, dissipation: float) -> float:
    """The buoyancy with which the simulated smoke's centre of mass arrives at the clip's height.

    The first half of the moments spins the velocity up, the second half is simulated freely.
    """
    if len(moments) < MIN_MOMENTS or not all(moment.density.any() for moment in moments):
        return 0.0
    while max(moments[0].density.shape) > COARSE:
        moments, inlets = [_halved(moment) for moment in moments], coarsen(inlets.astype(np.float32)) > 0
    half = len(moments) // 2
    still = Simulation(Physics(0.0, dissipation), Inflow(inlets, moments).cropped(), Surroundings(), dt)
    goal = _height(moments[-1].density)

    def missed(buoyancy: float) -> float:
        along = _along(replace(still, physics=Physics(buoyancy, dissipation)))
        moment = _spun_up(along, moments[: half + 1])
        for step in range(half + 1, len(moments)):
            moment = along.next(moment, step)
        return _height(moment.density) - goal

    density = moments[half].density
    typical = float(np.vdot(density, density) / density.sum(dtype=np.float64))
    by_a_voxel = moments[0].velocity.voxel_size / (typical * (half * dt) ** 2)
    return _root(missed, by_a_voxel)


def _root(function: Callable[[float], float], start: float) -> float:
    """The root of a function that is nearly linear, by the secant method from 0; 0 where the function does not change.

    Of the package's libraries `scipy.optimize` alone is not in the extension.
    """
    before, at_before, now = 0.0, function(0.0), start
    for _ in range(TRIALS):
        at_now = function(now)
        if abs(at_now - at_before) <= MIN_HEIGHT_DIFFERENCE:
            return 0.0
        before, now, at_before = now, now - at_now * (now - before) / (at_now - at_before), at_now
        if abs(now - before) <= PRECISION * abs(now):
            break
    return now


def _dissipation(moments: Sequence[Moment], dt: float, inlets: Mask) -> float:
    """The rate that brings the mass outside the inlets from that of the carried smoke to that found; at least 0."""
    carried_mass = found_mass = 0.0
    for before, after in pairwise(moments):
        carried = advect(before.density, after.velocity, dt, conserve=True)
        carried_mass += float(carried.sum(dtype=np.float64, where=~inlets))
        found_mass += float(after.density.sum(dtype=np.float64, where=~inlets))
    lost = math.log(carried_mass / found_mass) / dt if carried_mass > 0 and found_mass > 0 else 0.0
    return max(0.0, lost)


def _height(density: Array) -> float:
    """Height of the centre of mass, in voxels."""
    layers = density.sum((0, 1), dtype=np.float64)
    return float(layers @ np.arange(len(layers)) / max(layers.sum(), 1e-30))


def _halved(moment: Moment) -> Moment:
    """The moment on a grid half as fine."""
    coarse = coarsen_faces(moment.velocity)
    return Moment(coarsen(moment.density), Velocity(coarse.faces, coarse.voxel_size, coarse.closed))
