"""What a batch still takes."""

from __future__ import annotations

import pytest

from smokelift.batch import Frames, Record, duration, remaining_work
from smokelift.batch.record import Forecast


def test_the_pace_is_measured_scaled_or_foretold(make_shot) -> None:
    looked = Record(of={}, forecast=Forecast(10, 100.0, 7))
    half = Frames(4, seconds=[20.0] * 4)
    new, begun = make_shot("new"), make_shot("begun")
    (alone,) = remaining_work([(new, looked, Frames())])
    assert (alone.frames, alone.seconds, alone.basis, alone.memory) == (10, 100.0, "foretold", 7)
    first, second = remaining_work([(begun, looked, half), (new, looked, Frames())])
    assert (first.shot, first.seconds, first.basis) == (new, pytest.approx(200.0), "scaled")
    assert (second.shot, second.frames, second.seconds, second.basis) == (begun, 6, 120.0, "measured")


def test_finished_and_unknown_shots_are_left_out(make_shot) -> None:
    looked = Record(of={}, status="done", forecast=Forecast(2, 1.0, 1))
    known = [(make_shot("a"), looked, Frames(2, True, [9.0, 9.0])), (make_shot("b"), Record(of={}), Frames())]
    assert remaining_work(known) == ()
    assert duration((), 3) == 0.0


def test_the_longest_go_first_to_whoever_is_free(make_shot) -> None:
    shots = [
        (make_shot(f"{seconds}"), Record(of={}, forecast=Forecast(1, seconds, 1)), Frames())
        for seconds in (1.0, 5.0, 2.0, 3.0, 4.0)
    ]
    left = remaining_work(shots)
    assert [each.seconds for each in left] == [5.0, 4.0, 3.0, 2.0, 1.0]
    assert [duration(left, workers) for workers in (1, 2, 3, 9)] == [15.0, 8.0, 5.0, 5.0]
