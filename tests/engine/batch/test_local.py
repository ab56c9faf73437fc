"""Shots side by side on one machine."""

import threading
import time
from dataclasses import replace

import pytest

from smokelift.batch import Record, Room, run_here
from smokelift.batch.record import Forecast

DONE = Record(of={}, status="done")


@pytest.fixture
def shots(make_shot):
    """Make shots that need so much memory each."""

    def make(*needs: int):
        return [
            (make_shot(f"shot{n}"), Record(of={}, forecast=Forecast(1, 1.0, memory))) for n, memory in enumerate(needs)
        ]

    return make


class Worker:
    """Works on a shot for a moment, and notes how many did so at a time."""

    def __init__(self) -> None:
        self.order: list[str] = []
        self.most = self._now = 0
        self._lock = threading.Lock()

    def __call__(self, shot) -> Record:
        with self._lock:
            self.order.append(shot.name)
            self._now += 1
            self.most = max(self.most, self._now)
        time.sleep(0.05)
        with self._lock:
            self._now -= 1
        return DONE


@pytest.mark.parametrize(("memory", "at_a_time", "most"), [(30, 8, 3), (100, 2, 2), (5, 8, 1)])
def test_as_many_run_as_there_is_room_for(shots, memory, at_a_time, most) -> None:
    work = Worker()
    ended = list(run_here(shots(*[10] * 6), work, Room(memory, at_a_time), threading.Event()))
    assert sorted(shot.name for shot, _ in ended) == [f"shot{n}" for n in range(6)]
    assert work.most == most


def test_a_small_shot_overtakes_a_large_one(shots) -> None:
    work = Worker()
    list(run_here(shots(60, 60, 30), work, Room(100, 8), threading.Event()))
    assert work.order == ["shot0", "shot2", "shot1"]


def test_a_shot_without_a_forecast_runs_alone(shots) -> None:
    work = Worker()
    unknown = [(shot, replace(record, forecast=None)) for shot, record in shots(0, 0, 0)]
    list(run_here(unknown, work, Room(100, 8), threading.Event()))
    assert work.most == 1


def test_a_crash_is_tried_again_twice(shots) -> None:
    calls = []

    def crash(shot) -> Record:
        calls.append(shot)
        return replace(DONE, status="crashed")

    ((_, record),) = run_here(shots(1), crash, Room(1, 1), threading.Event())
    assert (record.status, len(calls)) == ("crashed", 3)


def test_leaving_early_stops_the_work(shots) -> None:
    stop = threading.Event()

    def wait(shot) -> Record:
        if shot.name != "shot0":
            assert stop.wait(10)
        return DONE

    began = time.monotonic()
    for _ in run_here(shots(1, 1), wait, Room(10, 2), stop):
        break
    assert stop.is_set()
    assert time.monotonic() - began < 5
