"""Buoyancy, dissipation and inflow of smoke whose physics is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.direct import Ball, Moment
from smokelift.direct.inflow import Inflow, find_inflow
from smokelift.direct.physics import fit_physics
from smokelift.transport import project
from tests.engine.direct.rising import DOMAIN, DT, PHYSICS, at_rest, blob, course, free, plume


def test_physics_of_a_free_blob_is_found():
    moments = course(free(), at_rest(blob()), 8)
    found = fit_physics(moments, DT, np.zeros(DOMAIN.shape, bool))
    assert found.buoyancy == pytest.approx(PHYSICS.buoyancy, rel=0.01)
    assert found.dissipation == pytest.approx(PHYSICS.dissipation, rel=0.01)


def test_a_buoyancy_that_the_moments_do_not_agree_on_is_none():
    """Errors of estimated velocities are as large as what buoyancy changes, and differ from frame to frame."""
    random = np.random.default_rng(1)
    moments = []
    for moment in course(free(), at_rest(blob()), 8):
        noise = [random.normal(size=f.shape).astype(np.float32) for f in moment.velocity.faces]
        velocity = project(moment.velocity.with_faces(f + n for f, n in zip(moment.velocity.faces, noise, strict=True)))
        moments.append(Moment(moment.density, velocity))
    assert fit_physics(moments, DT, np.zeros(DOMAIN.shape, bool)).buoyancy == 0


def test_smoke_without_motion_has_no_physics():
    moments = [at_rest(blob())] * 4
    found = fit_physics(moments, DT, np.zeros(DOMAIN.shape, bool))
    assert (found.buoyancy, found.dissipation) == (0, 0)
    empty = [at_rest(np.zeros(DOMAIN.shape, np.float32))] * 4
    assert fit_physics(empty, DT, np.zeros(DOMAIN.shape, bool)).buoyancy == 0


def test_the_inlet_of_a_plume_is_found():
    found = find_inflow(plume(), DT).voxels
    true = Ball((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    assert (found & true).sum() > 0.3 * true.sum()
    far = ~Ball((0.0, 0.0, 0.3), 0.7).voxels(DOMAIN)
    assert not (found & far).any()


def test_smoke_that_only_moves_has_no_inlet():
    assert not find_inflow(course(free(), at_rest(blob()), 8), DT).voxels.any()


def test_what_enters_at_changing_places_is_no_inlet():
    """A wrong velocity leaves it, and moves on."""
    rest = at_rest(blob())
    grown = [rest.density]
    for place in (-0.5,) * 4 + (0.5,) * 4:
        news = Ball((place, 0.0, 1.0), 0.3).voxels(DOMAIN)
        grown.append(grown[-1] + np.float32(0.2) * news)
    assert not find_inflow([replace(rest, density=density) for density in grown], DT).voxels.any()


def test_an_inlet_replays_its_moments_without_a_jump():
    moments = plume()[:4]
    inflow = Inflow(np.ones(DOMAIN.shape, bool), moments)
    places = [moments.index(inflow.at(step)) for step in range(9)]
    assert places == [3, 2, 1, 0, 1, 2, 3, 2, 1]
    assert Inflow(inflow.voxels, moments[:1]).at(5) is moments[0]
