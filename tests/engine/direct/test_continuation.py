"""Sequences that go on: what is kept, what is added, and how a run is resumed."""

import numpy as np
import pytest

from smokelift.direct.continuation import Continuation
from smokelift.direct.retiming import loop_sequence, retime_sequence
from smokelift.direct.state import open_source
from smokelift.direct.surroundings import Ball, Fan
from smokelift.output.index import SequenceError
from smokelift.output.sequence import Sequence
from tests.engine.direct.rising import plume, run, run_twice, write_plume


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
    assert made.provenance[-1]["origin"] == "made up"
    assert "Frames 11 to 15" in made.provenance[-1]["how"]


def test_a_given_buoyancy_and_dissipation_count(source, tmp_path):
    up = run(source, tmp_path / "up", Continuation(6, buoyancy=6.0, dissipation=0.0))
    down = run(source, tmp_path / "down", Continuation(6, buoyancy=-6.0, dissipation=1.0))
    assert up.velocity(16).faces[2].mean() > down.velocity(16).faces[2].mean()
    assert up.density(16).sum() > 1.1 * down.density(16).sum()
    assert down.figures(16)["buoyancy"] == -6
    assert "given buoyancy and dissipation" in down.provenance[-1]["how"]


def test_a_stopped_run_goes_on_to_the_same_result(source, tmp_path):
    continuation = Continuation(5, start=8, fade=3, wind=(0.4, 0.0, 0.0), obstacles=(Ball((0, 0, 1.6), 0.3),))
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


def test_impossible_continuations_are_refused(source, tmp_path):
    for impossible in (
        Continuation(5, start=99),
        Continuation(5, start=2),
        Continuation(5, obstacles=(Ball((99, 0, 0), 0.5),)),
        Continuation(5, obstacles=(Ball((9, 0, 0), 0.5),), room=1),
        Continuation(5, fans=(Fan(Ball((0, 0, -1), 0.5), (0, 0, 1)),)),
        Continuation(5, obstacles=(Ball((0, 0, 0), 9),)),
    ):
        with pytest.raises(ValueError):
            run(source, tmp_path / "out", impossible)
    assert not (tmp_path / "out").exists()
    short = tmp_path / "short"
    write_plume(short, 3)
    with pytest.raises(ValueError):
        open_source(short)
