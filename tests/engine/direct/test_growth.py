"""The box that grows with the smoke: nothing is cut, nothing jumps, and its end has no edge."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift import PointLight, advect
from smokelift.direct.continuation import (
    BLOCK,
    DISSOLVED,
    MARGIN_VOXELS,
    Continuation,
    Growth,
    camera_and_lamp_places,
    dissolve,
    in_larger_box,
    moves,
)
from smokelift.direct.state import SmokeState, open_source
from smokelift.direct.surroundings import Surroundings, Turbulence
from tests.engine.direct.rising import DOMAIN, DT, SCENE, along_x, at_rest, blob, run, run_twice

ROOMY = Growth(DOMAIN, ("z-",), 20 * DOMAIN.resolution[0] * DOMAIN.resolution[1] * DOMAIN.resolution[2])


def test_a_side_moves_before_smoke_arrives_there():
    def grown(state: SmokeState) -> tuple[tuple[int, int], ...]:
        return moves(DOMAIN, ROOMY.after(DOMAIN, state, DT))

    small = blob((0.0, 0.0, 1.5), 0.1)
    assert grown(at_rest(0 * small)) == grown(at_rest(small)) == ((0, 0),) * 3
    near = np.zeros_like(small)
    near[-MARGIN_VOXELS - 1, 8, 12] = 1.0
    assert grown(at_rest(near)) == ((0, 0),) * 3
    assert grown(at_rest(np.roll(near, 1, axis=0)))[0] == (0, BLOCK)
    # fast smoke is expected
    assert grown(SmokeState(near, along_x(2.5 * DOMAIN.voxel_size / DT)))[0] == (0, BLOCK)
    # the floor is a wall
    assert grown(at_rest(blob((0.0, 0.0, 0.0), 0.1)))[2] == (0, 0)


def test_a_box_stays_below_its_largest_size_and_before_cameras_and_lamps():
    tight = replace(ROOMY, voxels=2 * 16 * 16 * 24)
    assert tight.stopped(DOMAIN) == ()
    box = tight.after(DOMAIN, at_rest(np.ones(DOMAIN.shape, np.float32)), DT)
    assert np.prod(box.resolution) <= tight.voxels
    assert set(tight.stopped(box)) == {"x-", "x+", "y-", "y+", "z+"}
    lamp = PointLight((1.2, 0.0, 1.0), (1.0, 1.0, 1.0))
    outside = camera_and_lamp_places(replace(SCENE, lights=(*SCENE.lights, lamp)))
    assert outside == (SCENE.camera.position, lamp.position)
    assert replace(ROOMY, outside=outside).stopped(DOMAIN) == ("x+",)


def test_a_larger_box_changes_nothing_where_the_smaller_was():
    clip, larger = DOMAIN, DOMAIN.grown((8, 0, 16), (0, 8, 8))
    before, after = (
        Surroundings(box, (0.3, 0.0, 0.0), (Turbulence(0.5, 0.6),), first=box.first_in(clip)) for box in (clip, larger)
    )
    still = at_rest(blob())
    state = replace(still, velocity=still.velocity.with_faces(before.air(still.velocity, 0.5)), flame=still.density)
    found = in_larger_box(state, moves(clip, larger), before, after, 0.5)
    part = clip.slices_in(larger)
    np.testing.assert_array_equal(found.density[part], state.density)
    np.testing.assert_array_equal(found.flame[part], state.density)
    assert np.count_nonzero(found.density) == np.count_nonzero(state.density)
    for here, there in zip(found.velocity.faces, after.air(found.velocity, 0.5), strict=True):
        np.testing.assert_allclose(here, there, atol=2e-5)


def test_smoke_dissolves_softly_before_a_side_that_cannot_move():
    """What goes there fades with the distance, at any speed, and is gone at the side; what stays is not touched."""
    for speed in (0.5, 3.0):
        state = SmokeState(np.ones(DOMAIN.shape, np.float32), along_x(speed))
        for _ in range(round(3 / (speed * DT))):  # smoke that comes in all the time
            carried = advect(np.pad(state.density, ((0, 0),) * 3), state.velocity, DT)
            carried[:2] = 1
            state = dissolve(replace(state, density=carried), ("x+",), DT)
        profile = state.density[:, 8, 12]
        assert (profile[:9] > 0.9).all()
        assert profile[-1] < 0.1
        assert np.abs(np.diff(profile)).max() < 0.5
        mirrored = dissolve(SmokeState(state.density[::-1], along_x(-speed)), ("x-",), DT)
        np.testing.assert_allclose(mirrored.density[::-1], dissolve(state, ("x+",), DT).density, atol=1e-6)
    still = at_rest(blob((0.8, 0.0, 1.0)))
    assert dissolve(still, ("x+",), DT).density == pytest.approx(still.density)


def test_smoke_in_wind_leaves_the_clips_box_uncut(source, tmp_path):
    """The frames have boxes of their own and open as one sequence; a stopped run goes on to the same."""
    made, stopped = run_twice(source, tmp_path, Continuation(7, wind=(12.0, 0.0, 0.0), room=8), 14)
    whole, clip = made.scene.domain, source.scene.domain
    assert whole == made.box(17) and made.box(10) == clip
    assert made.density(10).shape == made.density(17).shape == whole.shape
    beyond = made.density(17)[clip.slices_in(whole)[0].stop :]
    assert beyond.sum() > 0.1 * made.density(17).sum()
    seen = made.density(17) > 1e-2 * made.density(17).max()
    assert not any(seen.take(side, axis).any() for axis in (0, 1) for side in (0, -1))
    assert made.figures(17)[DISSOLVED] == 0
    np.testing.assert_array_equal(stopped.density(17), made.density(17))
    again = run(open_source(tmp_path / "whole"), tmp_path / "again", Continuation(1))
    np.testing.assert_array_equal(again.density(10)[again.box(10).slices_in(again.scene.domain)], source.density(10))
    assert again.density(17).sum() == pytest.approx(made.density(17).sum())
