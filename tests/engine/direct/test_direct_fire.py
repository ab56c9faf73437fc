"""Fire after its clip."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.direct.fitting import fit_fire, fit_simulation
from smokelift.direct.simulation import Combustion
from smokelift.direct.surroundings import Ball, Surroundings
from tests.engine.direct.rising import DOMAIN, DT, LEFT, at_rest, blob, course, plume


def test_fire_without_fuel_burns_out():
    clip = plume(burning=True)
    simulation = fit_simulation(clip[:10], DT)
    unfed = replace(simulation, fire=Combustion(simulation.fire.remaining, np.zeros(DOMAIN.shape, np.float32)))
    assert course(unfed, clip[9], 12)[-1].flame.sum() == pytest.approx(LEFT**12 * clip[9].flame.sum(), rel=0.3)


def test_nothing_burns_in_an_obstacle():
    ball = Ball((0.0, 0.0, 0.3), 0.4)
    around = Surroundings(DOMAIN, obstacles=(ball,))
    clip = plume(burning=True)
    after = fit_simulation(clip, DT, surroundings=around).next(clip[-1], 1)
    assert not after.flame[ball.voxels(DOMAIN)].any()


def test_the_feed_makes_no_more_fire_than_the_clip_has() -> None:
    """Where less is left than elsewhere nothing feeds the fire; taken for nothing it would make the fire grow."""
    before, after = blob(), blob()
    after[:8] *= 0.4
    after[8:12] *= 0.8
    after[12:] *= 2.0
    states = [replace(at_rest(blob()), flame=flame) for flame in (before, after)]
    fire = fit_fire(states, DT)
    assert (fire.remaining * before + fire.feed).sum() == pytest.approx(after.sum(), rel=1e-4)
