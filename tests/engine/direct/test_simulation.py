"""A simulation that starts from a clip: mass, divergence, a hundred frames, and eddies in its air."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.direct.fitting import fit_simulation
from smokelift.direct.mesh import Mesh
from smokelift.direct.simulation import INTENSITY, Inflow, Physics, Simulation, small_eddy_speed, with_small_eddies
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Surroundings, Turbulence
from smokelift.scene import Inlet
from smokelift.transport import Velocity, at_centres, divergence, project
from tests.engine.direct.rising import DOMAIN, DT, PHYSICS, at_rest, blob, course, free, octahedron, plume

STILL = Velocity.zero((40, 40, 40), 0.05)
SHAPE = (32, 32, 40)
VOXEL = 0.05


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
    obstacle = Mesh(octahedron((0.0, 0.0, 1.4), 0.45))
    solid = obstacle.voxels(DOMAIN)
    start = at_rest(np.where(solid, np.float32(0), blob()))
    states = course(free(PHYSICS, Surroundings(DOMAIN, obstacles=(obstacle,))), start, 36)
    for state in states[1:]:
        assert not state.density[solid].any()
        assert np.abs(divergence(state.velocity))[~solid].max() * DOMAIN.voxel_size < 0.02
    above = 12  # the layer above the middle of the obstacle
    assert states[0].density[:, :, above:].sum() < 0.1 * mass(states[0])
    assert states[-1].density[:, :, above:].sum() > 0.3 * mass(states[-1])
    assert mass(states[-1]) / mass(states[0]) == pytest.approx(np.exp(-0.3 * 36 * DT), rel=0.01)


def test_an_obstacle_closes_the_inlet_that_it_covers():
    inlet = Inlet((0.0, 0.0, 1.4), 0.3)
    inflow = Inflow(inlet.voxels(DOMAIN), (at_rest(blob()),))
    around = Surroundings(DOMAIN, obstacles=(Mesh(octahedron(inlet.centre, 0.6)),))
    nothing = at_rest(np.zeros(DOMAIN.shape, np.float32))
    assert Simulation(PHYSICS, inflow, Surroundings(), DT).next(nothing, 1).density.any()
    assert not Simulation(PHYSICS, inflow, around, DT).next(nothing, 1).density.any()


def eddies(turbulence: Turbulence, time: float = 0.0) -> Velocity:
    return STILL.with_faces(turbulence.velocity(STILL, time))


def speed(velocity: Velocity) -> float:
    return float(np.sqrt(sum(np.square(component).mean() for component in velocity.faces)))


def correlation(a: Velocity, b: Velocity) -> float:
    """Correlation of two velocities."""
    return sum(float((u * v).mean()) for u, v in zip(a.faces, b.faces, strict=True)) / (speed(a) * speed(b))


def test_eddies_have_the_speed_and_the_size_asked_for():
    for size in (0.4, 0.8):
        found = eddies(Turbulence(0.7, size))
        assert speed(found) == pytest.approx(0.7, rel=0.1)
        assert np.abs(divergence(found)).max() < 0.02 * 0.7 * np.pi / size
        # an eddy further the air goes the other way, two further the same way again
        row = found.faces[2]
        steps = round(size / STILL.voxel_size)
        assert float((row[steps:] * row[:-steps]).mean()) < -0.1 * float((row * row).mean())


def test_eddies_change_in_the_time_that_air_takes_to_cross_them():
    now = eddies(Turbulence(0.5, 0.4))
    soon, late = (eddies(Turbulence(0.5, 0.4), time) for time in (0.08, 3.2))
    assert correlation(now, soon) > 0.95
    assert abs(correlation(now, late)) < 0.2


def test_a_seed_makes_the_same_eddies_on_any_grid():
    finer = Velocity.zero((80, 80, 80), 0.025)
    coarse, fine = (Turbulence(0.5, 0.4, 7).velocity(grid, 0.3)[0] for grid in (STILL, finer))
    middles = fine[::2].reshape(41, 40, 2, 40, 2).mean(axis=(2, 4))
    assert np.abs(middles - coarse).max() < 0.05
    assert abs(correlation(eddies(Turbulence(0.5, 0.4, 7)), eddies(Turbulence(0.5, 0.4, 8)))) < 0.2


def stirred(*sizes: float) -> SmokeState:
    """A block of smoke in eddies of some sizes in voxels, 0.4 m/s each."""
    density = np.zeros(SHAPE, np.float32)
    density[6:26, 6:26, 8:32] = 1
    still = Velocity.zero(SHAPE, VOXEL)
    each = [Turbulence(0.4, size * VOXEL, 9).velocity(still, 0.0) for size in sizes]
    return SmokeState(density, project(still.with_faces([sum(parts) for parts in zip(*each, strict=True)])))


def energy(state: SmokeState, smoke: bool = True) -> float:
    inside = (state.density > 0) == smoke
    return sum(float(np.square(u[inside]).mean()) for u in at_centres(state.velocity.faces))


def test_a_smooth_velocity_gains_eddies_in_the_smoke():
    smooth = stirred(16)
    eddy_speed = small_eddy_speed([smooth, smooth])
    assert eddy_speed == pytest.approx(INTENSITY * energy(smooth) ** 0.5, rel=1e-3)
    found = with_small_eddies(smooth.velocity, smooth.density, eddy_speed)
    gained = [replace(smooth, velocity=found), replace(smooth, velocity=project(found))]
    assert all(energy(state) > 1.05 * energy(smooth) for state in gained)
    far = np.ones(SHAPE, bool)
    far[1:-1, 1:-1, 1:-1] = False
    for before, after in zip(*(at_centres(m.velocity.faces) for m in (smooth, gained[1])), strict=True):
        assert np.abs(after - before)[far].mean() < 0.1 * np.abs(before)[far].mean()
    again, next_step = (with_small_eddies(smooth.velocity, smooth.density, eddy_speed, step) for step in (0, 1))
    np.testing.assert_array_equal(again.faces[0], found.faces[0])
    new = [
        smooth.velocity.with_faces(u - a for u, a in zip(m.faces, smooth.velocity.faces, strict=True))
        for m in (found, next_step)
    ]
    assert abs(correlation(*new)) < 0.2


def test_small_eddies_stay_as_fast_as_they_are():
    state = stirred(2.2, 4, 8)
    left = Simulation(Physics(0.0, 0.0), Inflow(np.zeros(SHAPE, bool), [state]).cropped(), Surroundings(), DT)
    kept = replace(left, eddy_speed=0.2)
    with_eddies, without = (course(each, state, 24)[-1] for each in (kept, left))
    assert energy(without) < 0.5 * energy(state)
    assert 0.7 < energy(with_eddies) / energy(state) < 2


def test_a_velocity_that_has_its_eddies_and_still_air_gain_none():
    full, still = stirred(2.2, 4, 8), SmokeState(np.ones(SHAPE, np.float32), Velocity.zero(SHAPE, VOXEL))
    for eddy_speed, state in ((0.05, full), (small_eddy_speed([still]), still)):
        found = with_small_eddies(state.velocity, state.density, eddy_speed, 1)
        np.testing.assert_array_equal(found.faces[2], state.velocity.faces[2])
