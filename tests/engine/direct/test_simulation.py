"""A simulation that starts from a clip: mass, divergence, and a hundred frames."""

import numpy as np
import pytest

from smokelift.direct import Ball, Moment, Simulation, fit_simulation
from smokelift.direct.inflow import Inflow
from smokelift.direct.obstacles import Obstacles
from smokelift.direct.simulation import Physics
from smokelift.direct.surroundings import Surroundings
from smokelift.transport import divergence
from tests.engine.direct.rising import DOMAIN, DT, PHYSICS, at_rest, blob, course, free, plume


def mass(moment: Moment) -> float:
    return float(moment.density.sum(dtype=float))


def height(moment: Moment, axis: int = 2) -> float:
    """Centre of mass in metres."""
    sums = moment.density.sum(axis=tuple(d for d in range(3) if d != axis), dtype=float)
    return float((sums * np.arange(len(sums))).sum() / sums.sum()) * DOMAIN.voxel_size


def test_a_blob_rises_as_it_should_and_keeps_its_mass():
    moments = course(free(Physics(2.0, 0.0)), at_rest(blob()), 12)
    assert mass(moments[-1]) == pytest.approx(mass(moments[0]), rel=1e-3)
    heights = [height(moment) for moment in moments]
    assert all(np.diff(heights) > 0)
    assert 0.02 < heights[-1] - heights[0] < 0.5 * 2.0 * (12 * DT) ** 2


def test_a_hundred_frames_do_not_blow_up():
    clip = plume()
    moments = course(fit_simulation(clip, DT), clip[-1], 100)
    fastest = [max(float(np.abs(f).max()) for f in m.velocity.faces) for m in (*clip, *moments)]
    assert max(fastest) < 2 * max(fastest[: len(clip)])
    assert 0.5 < mass(moments[-1]) / mass(clip[-1]) < 2
    assert max(float(np.abs(divergence(m.velocity)).max()) for m in moments) * DOMAIN.voxel_size < 1e-5
    # it neither stops nor becomes steady
    assert max(float(np.abs(f).max()) for f in moments[-1].velocity.faces) > 0.3 * max(fastest[: len(clip)])


def test_wind_carries_the_smoke_along():
    moments = course(free(Physics(0.0, 0.0), Surroundings(wind=(0.5, 0.0, 0.0))), at_rest(blob()), 24)
    gone = 0.5 * (24 * DT - 0.5 * (1 - np.exp(-24 * DT / 0.5)))
    assert height(moments[-1], 0) - height(moments[0], 0) == pytest.approx(gone, rel=0.05)
    assert abs(height(moments[-1], 1) - height(moments[0], 1)) < 0.01


def test_smoke_goes_round_an_obstacle():
    ball = Ball((0.0, 0.0, 1.4), 0.35)
    solid = ball.voxels(DOMAIN)
    start = at_rest(np.where(solid, np.float32(0), blob()))
    moments = course(free(PHYSICS, Surroundings(obstacles=Obstacles(DOMAIN, (ball,)))), start, 36)
    for moment in moments[1:]:
        assert not moment.density[solid].any()
        assert np.abs(divergence(moment.velocity))[~solid].max() * DOMAIN.voxel_size < 0.02
    above = 12  # the layer above the middle of the ball
    assert moments[0].density[:, :, above:].sum() < 0.1 * mass(moments[0])
    assert moments[-1].density[:, :, above:].sum() > 0.3 * mass(moments[-1])
    assert mass(moments[-1]) / mass(moments[0]) == pytest.approx(np.exp(-0.3 * 36 * DT), rel=0.01)


def test_an_obstacle_closes_the_inlet_that_it_covers():
    inlet = Ball((0.0, 0.0, 1.4), 0.3)
    inflow = Inflow(inlet.voxels(DOMAIN), (at_rest(blob()),))
    around = Surroundings(obstacles=Obstacles(DOMAIN, (Ball(inlet.centre, 0.4),)))
    nothing = at_rest(np.zeros(DOMAIN.shape, np.float32))
    assert Simulation(PHYSICS, inflow, Surroundings(), DT).next(nothing, 1).density.any()
    assert not Simulation(PHYSICS, inflow, around, DT).next(nothing, 1).density.any()
