"""A simulation that starts from a clip: mass, divergence, and a hundred frames."""

import numpy as np
import pytest

from smokelift.direct.fitting import fit_simulation
from smokelift.direct.simulation import Inflow, Physics, Simulation
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Ball, Surroundings
from smokelift.transport import divergence
from tests.engine.direct.rising import DOMAIN, DT, PHYSICS, at_rest, blob, course, free, plume


def mass(state: SmokeState) -> float:
    return float(state.density.sum(dtype=float))


def height(state: SmokeState, axis: int = 2) -> float:
    """Center of mass in meters."""
    sums = state.density.sum(axis=tuple(d for d in range(3) if d != axis), dtype=float)
    return float((sums * np.arange(len(sums))).sum() / sums.sum()) * DOMAIN.voxel_size


def test_a_blob_rises_as_it_should_and_keeps_its_mass():
    states = course(free(Physics(2.0, 0.0)), at_rest(blob()), 12)
    assert mass(states[-1]) == pytest.approx(mass(states[0]), rel=1e-3)
    heights = [height(state) for state in states]
    assert all(np.diff(heights) > 0)
    assert 0.02 < heights[-1] - heights[0] < 0.5 * 2.0 * (12 * DT) ** 2


def test_a_hundred_frames_do_not_blow_up():
    clip = plume()
    states = course(fit_simulation(clip, DT), clip[-1], 100)
    fastest = [max(float(np.abs(f).max()) for f in m.velocity.faces) for m in (*clip, *states)]
    assert max(fastest) < 2 * max(fastest[: len(clip)])
    assert 0.5 < mass(states[-1]) / mass(clip[-1]) < 2
    assert max(float(np.abs(divergence(m.velocity)).max()) for m in states) * DOMAIN.voxel_size < 1e-5
    # it neither stops nor becomes steady
    assert max(float(np.abs(f).max()) for f in states[-1].velocity.faces) > 0.3 * max(fastest[: len(clip)])


def test_wind_carries_the_smoke_along():
    states = course(free(Physics(0.0, 0.0), Surroundings(wind=(0.5, 0.0, 0.0))), at_rest(blob()), 24)
    gone = 0.5 * (24 * DT - 0.5 * (1 - np.exp(-24 * DT / 0.5)))
    assert height(states[-1], 0) - height(states[0], 0) == pytest.approx(gone, rel=0.05)
    assert abs(height(states[-1], 1) - height(states[0], 1)) < 0.01


def test_smoke_goes_round_an_obstacle():
    ball = Ball((0.0, 0.0, 1.4), 0.35)
    solid = ball.voxels(DOMAIN)
    start = at_rest(np.where(solid, np.float32(0), blob()))
    states = course(free(PHYSICS, Surroundings(DOMAIN, obstacles=(ball,))), start, 36)
    for state in states[1:]:
        assert not state.density[solid].any()
        assert np.abs(divergence(state.velocity))[~solid].max() * DOMAIN.voxel_size < 0.02
    above = 12  # the layer above the middle of the ball
    assert states[0].density[:, :, above:].sum() < 0.1 * mass(states[0])
    assert states[-1].density[:, :, above:].sum() > 0.3 * mass(states[-1])
    assert mass(states[-1]) / mass(states[0]) == pytest.approx(np.exp(-0.3 * 36 * DT), rel=0.01)


def test_an_obstacle_closes_the_inlet_that_it_covers():
    inlet = Ball((0.0, 0.0, 1.4), 0.3)
    inflow = Inflow(inlet.voxels(DOMAIN), (at_rest(blob()),))
    around = Surroundings(DOMAIN, obstacles=(Ball(inlet.centre, 0.4),))
    nothing = at_rest(np.zeros(DOMAIN.shape, np.float32))
    assert Simulation(PHYSICS, inflow, Surroundings(), DT).next(nothing, 1).density.any()
    assert not Simulation(PHYSICS, inflow, around, DT).next(nothing, 1).density.any()
