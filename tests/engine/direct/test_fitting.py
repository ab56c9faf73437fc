"""Buoyancy, dissipation, inflow and velocity of smoke whose physics is known."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.direct.fitting import coarsen_state, fit_simulation, spin_up
from smokelift.direct.simulation import Physics
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Ball
from smokelift.transport import Velocity
from tests.engine.direct.rising import DOMAIN, DT, PHYSICS, at_rest, blob, course, free, plume


def slowed(state: SmokeState, factor: float) -> SmokeState:
    """A state with a velocity that is estimated too slow."""
    faces = (np.float32(factor) * component for component in state.velocity.faces)
    return replace(state, velocity=state.velocity.with_faces(faces))


def error(found: Velocity, true: Velocity) -> float:
    """The error of a velocity over its size."""
    square = sum(float(np.sum((a - b) ** 2)) for a, b in zip(found.faces, true.faces, strict=True))
    return (square / sum(float(np.sum(b**2)) for b in true.faces)) ** 0.5


def test_physics_of_a_free_blob_is_found():
    found = fit_simulation(course(free(), at_rest(blob()), 11), DT).physics
    assert found.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=0.02)
    assert found.dissipation == pytest.approx(PHYSICS.dissipation, rel=0.01)


def test_a_head_that_dissolves_above_a_base_that_is_fed_rises():
    """Its center of mass sinks."""
    height = np.linspace(0, 1, DOMAIN.resolution[2])
    states = [
        replace(state, density=(state.density * np.exp(-6 * DT * number * height)).astype(np.float32))
        for number, state in enumerate(plume())
    ]
    assert fit_simulation(states, DT, Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)).physics.buoyancy > 1


@pytest.mark.parametrize("buoyancy", [3.0, -3.0])
def test_a_buoyancy_against_the_clips_own_motion_is_not_taken(buoyancy):
    states = course(free(Physics(buoyancy, 0.0)), at_rest(blob((0.0, 0.0, 1.5))), 11)
    nowhere = np.zeros(DOMAIN.shape, bool)
    assert fit_simulation(states, DT, nowhere).physics.contradicted_buoyancy == 0
    against = fit_simulation([slowed(state, -1.0) for state in states], DT, nowhere).physics
    assert against.buoyancy == 0
    assert against.contradicted_buoyancy == pytest.approx(buoyancy, rel=0.1)


def test_buoyancy_is_found_from_velocities_that_are_too_slow_and_from_earlier_states():
    states = [slowed(state, 0.6) for state in course(free(), at_rest(blob()), 23)]
    found = fit_simulation(states[-6:], DT, earlier=[coarsen_state(state) for state in states[:-6]]).physics
    assert found.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=0.15)
    assert found.buoyancy == pytest.approx(fit_simulation(states, DT).physics.buoyancy)


def test_physics_is_not_fitted_where_it_is_given_or_nothing_shows_it():
    rising, still, empty = course(free(), at_rest(blob()), 9), at_rest(blob()), at_rest(0 * blob())
    assert fit_simulation(rising, DT, buoyancy=-1.5, dissipation=0.2).physics == Physics(-1.5, 0.2)
    assert fit_simulation(rising[:6], DT).physics.buoyancy == 0, "too few"
    assert fit_simulation([empty] * 9, DT).physics == Physics(0.0, 0.0)
    found = fit_simulation([still] * 9, DT).physics
    assert (found.buoyancy, found.dissipation) == (pytest.approx(0, abs=1e-3), 0)


def test_the_forces_of_a_clip_make_its_velocity_from_one_that_is_too_slow():
    states = course(free(), at_rest(blob()), 16)[5:]
    slow = [slowed(state, 0.5) for state in states]
    found = spin_up(free(), slow)
    assert found.density is slow[-1].density
    assert error(found.velocity, states[-1].velocity) < 0.5 * error(slow[-1].velocity, states[-1].velocity)


@pytest.mark.parametrize(("factor", "difference", "left"), [(1.0, 0.1, 0.05), (-5.0, 0.2, 0.1)], ids=["right", "wrong"])
def test_a_velocity_that_the_forces_explain_stays_and_one_estimated_wrong_does_not_go_on(factor, difference, left):
    states, inlet = plume(), Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    estimated = [slowed(states[0], factor), *states[1:]]
    simulation = fit_simulation(estimated, DT, inlet)
    assert simulation.physics.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=difference)
    assert error(spin_up(replace(simulation, eddy_speed=0.0), estimated).velocity, states[-1].velocity) < left
