"""Sequences that go on: what is kept and added, how a run is resumed, how fire burns and the box grows."""

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
from smokelift.direct.fitting import fit_fire, fit_simulation
from smokelift.direct.mesh import Mesh
from smokelift.direct.retiming import loop_sequence, retime_sequence
from smokelift.direct.simulation import Combustion
from smokelift.direct.state import SmokeState, open_source
from smokelift.direct.surroundings import Surroundings, Turbulence
from smokelift.output.index import SequenceError
from smokelift.output.sequence import Sequence
from tests.engine.direct.rising import (
    DOMAIN,
    DT,
    LEFT,
    SCENE,
    along_x,
    at_rest,
    blob,
    course,
    octahedron,
    plume,
    run,
    run_twice,
    write_plume,
)

ROOMY = Growth(DOMAIN, ("z-",), 20 * DOMAIN.resolution[0] * DOMAIN.resolution[1] * DOMAIN.resolution[2])


def test_a_continuation_keeps_the_frames_of_the_clip_and_adds_its_own(source, tmp_path):
    made = run(source, tmp_path / "out", Continuation(5))
    assert made.complete
    assert made.frames == tuple(range(1, 16))
    for number in source.frames:
        assert made.files(number)["npz"].read_bytes() == source.files(number)["npz"].read_bytes()
    assert made.figures(3)["psnr"] == 30
    # ours goes on as the simulation that made the clip did, although the inlet is only found, and eddies are made up
    true = plume()[14].density
    part = source.scene.domain.slices_in(made.scene.domain)
    error = np.linalg.norm(made.density(15)[part] - true) / np.linalg.norm(true)
    held = np.linalg.norm(source.density(10) - true) / np.linalg.norm(true)
    assert error < 0.65 * held
    said = made.provenance[-1]
    assert (said["what"], said["origin"], said["kind"]) == ("continue", "made up", "simulated frames")
    assert said["figures"] == {"frame": 10, "first": 11, "last": 15, "given": ""}
    assert "Frames 11 to 15 are a simulation that starts from frame 10" in said["how"]


def test_a_given_buoyancy_and_dissipation_count(source, tmp_path):
    up = run(source, tmp_path / "up", Continuation(6, buoyancy=6.0, dissipation=0.0))
    down = run(source, tmp_path / "down", Continuation(6, buoyancy=-6.0, dissipation=1.0))
    assert up.velocity(16).faces[2].mean() > down.velocity(16).faces[2].mean()
    assert up.density(16).sum() > 1.1 * down.density(16).sum()
    assert down.figures(16)["buoyancy"] == -6
    assert "given buoyancy and dissipation" in down.provenance[-1]["how"]


def test_a_stopped_run_goes_on_to_the_same_result(source, tmp_path):
    continuation = Continuation(
        5, start=8, fade=3, wind=(0.4, 0.0, 0.0), obstacles=(Mesh(octahedron((0, 0, 1.6), 0.4)),)
    )
    whole, stopped = run_twice(source, tmp_path, continuation, 11)
    assert whole.frames == stopped.frames == tuple(range(1, 14))
    for number in whole.frames:
        np.testing.assert_array_equal(whole.density(number), stopped.density(number))
    assert not whole.density(13).any()
    with pytest.raises(SequenceError):
        run(source, tmp_path / "stopped", Continuation(6, start=8), resume=True)


def test_fire_goes_on_and_fades_with_the_smoke(tmp_path):
    write_plume(tmp_path / "source", 6, burning=True)
    burning = open_source(tmp_path / "source")
    whole, stopped = run_twice(burning, tmp_path, Continuation(3, fade=2), 8)
    sums = [float(whole.flame(number).sum()) for number in whole.frames]
    assert min(sums[:7]) > 0.5 * max(sums)
    assert sums[7] == pytest.approx(0.5 * sums[6], rel=0.2)
    assert sums[8] == 0.0
    assert [float(stopped.flame(number).sum()) for number in stopped.frames] == sums
    list(retime_sequence(burning, tmp_path / "slow", (0.8,), npz=True))
    list(loop_sequence(burning, tmp_path / "loop", 1, 6, 2, npz=True))
    for name in ("slow", "loop"):
        made = Sequence.open(tmp_path / name)
        assert all(0.5 * max(sums) < made.flame(n).sum() < 1.2 * max(sums) for n in made.frames)


def test_sides_become_walls(source, tmp_path):
    walls = ("x-", "x+", "y-", "y+", "z+")
    shut, free = (
        run(source, tmp_path / str(len(closed)), Continuation(3, closed=closed)).velocity(13).faces
        for closed in (walls, ())
    )
    assert not any(np.take(shut[axis], (0, -1), axis).any() for axis in range(3))
    assert all(np.take(free[axis], (0, -1), axis).any() for axis in range(3))


def test_a_sequence_that_shows_no_motion_is_refused(tmp_path):
    write_plume(tmp_path, 3)
    with pytest.raises(ValueError, match="has 3 frames; 4 are needed"):
        open_source(tmp_path)


def test_fire_without_fuel_burns_out():
    clip = plume(burning=True)
    simulation = fit_simulation(clip[:10], DT)
    unfed = replace(simulation, fire=Combustion(simulation.fire.remaining, np.zeros(DOMAIN.shape, np.float32)))
    assert course(unfed, clip[9], 12)[-1].flame.sum() == pytest.approx(LEFT**12 * clip[9].flame.sum(), rel=0.3)


def test_nothing_burns_in_an_obstacle():
    obstacle = Mesh(octahedron((0.0, 0.0, 0.3), 0.6))
    around = Surroundings(DOMAIN, obstacles=(obstacle,))
    clip = plume(burning=True)
    after = fit_simulation(clip, DT, surroundings=around).next(clip[-1], 1)
    assert not after.flame[obstacle.voxels(DOMAIN)].any()


def test_the_feed_makes_no_more_fire_than_the_clip_has() -> None:
    """Where less is left than elsewhere nothing feeds the fire; taken for nothing it would make the fire grow."""
    before, after = blob(), blob()
    after[:8] *= 0.4
    after[8:12] *= 0.8
    after[12:] *= 2.0
    states = [replace(at_rest(blob()), flame=flame) for flame in (before, after)]
    fire = fit_fire(states, DT)
    assert (fire.remaining * before + fire.feed).sum() == pytest.approx(after.sum(), rel=1e-4)


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
    made, stopped = run_twice(source, tmp_path, Continuation(5, wind=(24.0, 0.0, 0.0), room=8), 12)
    whole, clip = made.scene.domain, source.scene.domain
    assert whole == made.box(15) and made.box(10) == clip
    assert made.density(10).shape == made.density(15).shape == whole.shape
    beyond = made.density(15)[clip.slices_in(whole)[0].stop :]
    assert beyond.sum() > 0.1 * made.density(15).sum()
    seen = made.density(15) > 1e-2 * made.density(15).max()
    assert not any(seen.take(side, axis).any() for axis in (0, 1) for side in (0, -1))
    assert made.figures(15)[DISSOLVED] == 0
    np.testing.assert_array_equal(stopped.density(15), made.density(15))
    again = run(open_source(tmp_path / "whole"), tmp_path / "again", Continuation(1))
    np.testing.assert_array_equal(again.density(10)[again.box(10).slices_in(again.scene.domain)], source.density(10))
    assert again.density(15).sum() == pytest.approx(made.density(15).sum())
