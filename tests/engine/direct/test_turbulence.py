"""Eddies in all air: their speed, their size, and what they do to smoke."""

import numpy as np
import pytest

from smokelift.direct import Moment, Turbulence
from smokelift.direct.simulation import Physics
from smokelift.direct.surroundings import Surroundings
from smokelift.transport import Velocity, divergence
from tests.engine.direct.rising import DOMAIN, at_rest, blob, course, free

STILL = Velocity.zero((40, 40, 40), 0.05)


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


def test_a_hundred_frames_keep_the_speed_of_the_eddies():
    around = Surroundings(wind=(0.3, 0.0, 0.0), turbulences=(Turbulence(0.5, 0.5, 1),))
    nothing = Moment(np.zeros(DOMAIN.shape, np.float32), at_rest(blob()).velocity)
    moments = course(free(Physics(0.0, 0.0), around), nothing, 100)
    assert speed(moments[-1].velocity) == pytest.approx(np.hypot(0.3, 0.5), rel=0.25)
    assert max(speed(m.velocity) for m in moments) < 1.3 * np.hypot(0.3, 0.5)
