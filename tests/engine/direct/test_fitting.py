"""Buoyancy, dissipation, inflow and velocity of smoke whose physics is known."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.direct import Ball, Moment, coarse, fit_simulation, spun_up
from smokelift.direct.inflow import Inflow, find_inflow
from smokelift.direct.simulation import Physics
from smokelift.transport import Velocity
from tests.engine.direct.rising import DOMAIN, DT, PHYSICS, at_rest, blob, course, free, plume


def slowed(moment: Moment, share: float) -> Moment:
    """A moment with a velocity that is estimated too slow."""
    faces = (np.float32(share) * component for component in moment.velocity.faces)
    return replace(moment, velocity=moment.velocity.with_faces(faces))


def error(found: Velocity, true: Velocity) -> float:
    """The error of a velocity over its size."""
    square = sum(float(np.sum((a - b) ** 2)) for a, b in zip(found.faces, true.faces, strict=True))
    return (square / sum(float(np.sum(b**2)) for b in true.faces)) ** 0.5


def test_physics_of_a_free_blob_is_found():
    found = fit_simulation(course(free(), at_rest(blob()), 11), DT).physics
    assert found.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=0.02)
    assert found.dissipation == pytest.approx(PHYSICS.dissipation, rel=0.01)


def test_buoyancy_is_found_from_velocities_that_are_too_slow():
    moments = [slowed(moment, 0.6) for moment in course(free(), at_rest(blob()), 23)]
    assert fit_simulation(moments, DT).physics.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=0.15)


def test_a_head_that_dissolves_above_a_base_that_is_fed_rises():
    """Its centre of mass sinks."""
    share = np.linspace(0, 1, DOMAIN.resolution[2])
    moments = [
        replace(moment, density=(moment.density * np.exp(-6 * DT * number * share)).astype(np.float32))
        for number, moment in enumerate(plume())
    ]
    assert fit_simulation(moments, DT, Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)).physics.buoyancy > 1


@pytest.mark.parametrize("buoyancy", [3.0, -3.0])
def test_a_buoyancy_against_the_clips_own_motion_is_not_taken(buoyancy):
    moments = course(free(Physics(buoyancy, 0.0)), at_rest(blob((0.0, 0.0, 1.5))), 11)
    nowhere = np.zeros(DOMAIN.shape, bool)
    assert fit_simulation(moments, DT, nowhere).physics.contradicted_buoyancy == 0
    against = fit_simulation([slowed(moment, -1.0) for moment in moments], DT, nowhere).physics
    assert against.buoyancy == 0
    assert against.contradicted_buoyancy == pytest.approx(buoyancy, rel=0.1)


def test_earlier_moments_show_the_buoyancy_too():
    moments = [slowed(moment, 0.6) for moment in course(free(), at_rest(blob()), 23)]
    found = fit_simulation(moments[-6:], DT, earlier=[coarse(moment) for moment in moments[:-6]]).physics
    assert found.buoyancy == pytest.approx(fit_simulation(moments, DT).physics.buoyancy)


def test_what_is_given_is_not_fitted():
    moments = course(free(), at_rest(blob()), 9)
    assert fit_simulation(moments, DT, buoyancy=-1.5, dissipation=0.2).physics == Physics(-1.5, 0.2)


def test_few_moments_show_no_buoyancy():
    assert fit_simulation(course(free(), at_rest(blob()), 5), DT).physics.buoyancy == 0


def test_smoke_without_motion_has_no_physics():
    found = fit_simulation([at_rest(blob())] * 9, DT).physics
    assert found.buoyancy == pytest.approx(0, abs=1e-3)
    assert found.dissipation == 0
    empty = [at_rest(np.zeros(DOMAIN.shape, np.float32))] * 9
    assert fit_simulation(empty, DT).physics == Physics(0.0, 0.0)


def test_the_forces_of_a_clip_make_its_velocity_from_one_that_is_too_slow():
    moments = course(free(), at_rest(blob()), 16)[5:]
    slow = [slowed(moment, 0.5) for moment in moments]
    found = spun_up(free(), slow)
    assert found.density is slow[-1].density
    assert error(found.velocity, moments[-1].velocity) < 0.5 * error(slow[-1].velocity, moments[-1].velocity)


def test_a_velocity_that_is_estimated_wrong_does_not_go_on():
    moments, inlet = plume(), Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    wrong = [slowed(moments[0], -5.0), *moments[1:]]
    simulation = fit_simulation(wrong, DT, inlet)
    assert simulation.physics.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=0.2)
    assert error(spun_up(simulation, wrong).velocity, moments[-1].velocity) < 0.1


def test_a_velocity_that_the_forces_explain_stays():
    moments, inlet = plume(), Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    simulation = fit_simulation(moments, DT, inlet)
    assert simulation.physics.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=0.1)
    assert error(spun_up(simulation, moments).velocity, moments[-1].velocity) < 0.05


def test_the_inlet_of_a_plume_is_found():
    found = find_inflow(plume(), DT).voxels
    true = Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    assert (found & true).sum() > 0.3 * true.sum()
    far = ~Ball((0.0, 0.0, 0.3), 0.7).voxels(DOMAIN)
    assert not (found & far).any()


def test_smoke_that_only_moves_has_no_inlet():
    assert not find_inflow(course(free(), at_rest(blob()), 8), DT).voxels.any()


def test_what_enters_at_changing_places_is_no_inlet():
    rest = at_rest(blob())
    grown = [rest.density]
    for place in (-0.5,) * 4 + (0.5,) * 4:
        news = Ball((place, 0.0, 1.0), 0.3).voxels(DOMAIN)
        grown.append(grown[-1] + np.float32(0.2) * news)
    assert not find_inflow([replace(rest, density=density) for density in grown], DT).voxels.any()


def test_where_smoke_gathers_before_it_leaves_is_no_inlet():
    """Too little of what rises to an open side goes out in a reconstruction, so that there is more than comes."""
    rising = [np.zeros_like(component) for component in at_rest(blob()).velocity.faces]
    rising[2][:] = 0.2
    top = blob((0.0, 0.0, 2.9))
    moments = [Moment(np.float32(1 + 0.2 * number) * top, Velocity(rising, DOMAIN.voxel_size)) for number in range(8)]
    assert not find_inflow(moments, DT).voxels.any()
    sinking = [replace(m, velocity=m.velocity.with_faces(-u for u in m.velocity.faces)) for m in moments]
    assert find_inflow(sinking, DT).voxels.any()


def test_an_inlet_replays_its_moments_without_a_jump():
    moments = plume()[:4]
    inflow = Inflow(np.ones(DOMAIN.shape, bool), moments)
    places = [moments.index(inflow.at(step)) for step in range(9)]
    assert places == [3, 2, 1, 0, 1, 2, 3, 2, 1]
    assert Inflow(inflow.voxels, moments[:1]).at(5) is moments[0]
