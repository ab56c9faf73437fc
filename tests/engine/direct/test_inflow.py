"""Inlets: what counts as smoke that enters, what does not, and what enters after the clip."""

from dataclasses import replace

import numpy as np

from smokelift.direct.fitting import find_inflow, inlet_score
from smokelift.direct.simulation import Inflow
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Ball
from smokelift.transport import Velocity
from tests.engine.direct.rising import DOMAIN, DT, at_rest, blob, course, free, plume

SHAPE = (24, 24, 32)
INLET = (slice(8, 14), slice(8, 14), slice(4, 10))
FRONT = (slice(4, 20), slice(4, 20), slice(24, 29))


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
    true = Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    assert (found & true).sum() > 0.3 * true.sum()
    far = ~Ball((0.0, 0.0, 0.3), 0.7).voxels(DOMAIN)
    assert not (found & far).any()
    for scale in np.float32([1e-3, 1e3]):
        scaled = [replace(state, density=scale * state.density) for state in plume()]
        np.testing.assert_array_equal(find_inflow(scaled, DT).voxels, found)


def test_what_only_moves_or_enters_at_changing_places_is_no_inlet() -> None:
    assert not find_inflow(course(free(), at_rest(blob()), 8), DT).voxels.any()
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
