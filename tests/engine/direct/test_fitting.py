"""Buoyancy, dissipation, inlets and velocity of smoke whose physics is known."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.direct.fitting import coarsen_state, find_inflow, fit_simulation, inlet_score, spin_up
from smokelift.direct.simulation import Inflow, Physics
from smokelift.direct.state import SmokeState
from smokelift.scene import Inlet
from smokelift.transport import Velocity
from tests.engine.direct.rising import DOMAIN, DT, PHYSICS, at_rest, blob, course, free, plume

SHAPE = (24, 24, 32)
INLET = (slice(8, 14), slice(8, 14), slice(4, 10))
FRONT = (slice(4, 20), slice(4, 20), slice(24, 29))


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
    assert fit_simulation(states, DT, Inlet((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)).physics.buoyancy > 1


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
    states, inlet = plume(), Inlet((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    estimated = [slowed(states[0], factor), *states[1:]]
    simulation = fit_simulation(estimated, DT, inlet)
    assert simulation.physics.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=difference)
    assert error(spin_up(replace(simulation, eddy_speed=0.0), estimated).velocity, states[-1].velocity) < left


def residual(inlet: float = 0.0, front: float = 0.0) -> np.ndarray:
    """What motion that is a little wrong leaves, with new smoke in an inlet and before a front."""
    x, y, z = np.indices(SHAPE)
    left = 0.02 * np.sin(1.3 * x) * np.cos(1.1 * y) * np.sin(0.9 * z)
    left[INLET] += inlet
    left[FRONT] += front
    return left.astype(np.float32)


def score(*changes: np.ndarray) -> np.ndarray:
    return inlet_score(changes, np.ones(SHAPE, bool))


def test_an_inlet_stands_out_from_motion_that_is_wrong_and_from_what_passes() -> None:
    alone, front = score(residual(inlet=0.5)), score(residual(front=0.05))
    assert alone[10, 10, 7] == 1 and alone[FRONT].max() < 0.1
    assert score(residual()).max() < 0.1
    assert front[12, 12, 26] > 0.9, "a weak front beside an inlet is none"
    beside = score(residual(front=0.05, inlet=1.0))
    lasting = score(*[residual(inlet=0.5)] * 8, residual(inlet=0.5, front=0.2))
    for found in (beside, lasting):
        assert (found[12, 12, 26], found[10, 10, 7]) == (0, 1)


def test_the_inlet_of_a_plume_is_found():
    found = find_inflow(plume(), DT).voxels
    true = Inlet((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    assert (found & true).sum() > 0.3 * true.sum()
    far = ~Inlet((0.0, 0.0, 0.3), 0.7).voxels(DOMAIN)
    assert not (found & far).any()
    for scale in np.float32([1e-3, 1e3]):
        scaled = [replace(state, density=scale * state.density) for state in plume()]
        np.testing.assert_array_equal(find_inflow(scaled, DT).voxels, found)


def test_what_only_moves_or_enters_at_changing_places_is_no_inlet() -> None:
    assert not find_inflow(course(free(), at_rest(blob()), 8), DT).voxels.any()
    rest = at_rest(blob())
    grown = [rest.density]
    for place in (-0.5,) * 4 + (0.5,) * 4:
        news = Inlet((place, 0.0, 1.0), 0.3).voxels(DOMAIN)
        grown.append(grown[-1] + np.float32(0.2) * news)
    assert not find_inflow([replace(rest, density=density) for density in grown], DT).voxels.any()


def test_where_smoke_gathers_before_it_leaves_is_no_inlet():
    """Too little of what rises to an open side goes out in a reconstruction, so that there is more than comes."""
    rising = [np.zeros_like(component) for component in at_rest(blob()).velocity.faces]
    rising[2][:] = 0.2
    top = blob((0.0, 0.0, 2.9))
    states = [
        SmokeState(np.float32(1 + 0.2 * number) * top, Velocity(rising, DOMAIN.voxel_size)) for number in range(8)
    ]
    assert not find_inflow(states, DT).voxels.any()
    sinking = [replace(m, velocity=m.velocity.with_faces(-u for u in m.velocity.faces)) for m in states]
    assert find_inflow(sinking, DT).voxels.any()


def test_an_inlet_replays_its_states_without_a_jump():
    states = plume()[:4]
    inflow = Inflow(np.ones(DOMAIN.shape, bool), states)
    places = [states.index(inflow.at(step)) for step in range(9)]
    assert places == [3, 2, 1, 0, 1, 2, 3, 2, 1]
    assert Inflow(inflow.voxels, states[:1]).at(5) is states[0]
