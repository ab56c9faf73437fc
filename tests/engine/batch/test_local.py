"""Shots side by side on one machine."""

import threading
import time

import pytest

from smokelift.batch.local import run_here
from smokelift.batch.work import Record

DONE = Record(of={}, status="done")


@pytest.fixture
def shots(make_shot):
    """Make shots that need so much memory each."""

    def make(*needs: int):
        return [(make_shot(f"shot{n}"), memory) for n, memory in enumerate(needs)]

    return make


class Worker:
    """Works on a shot for a moment, and notes how many did so at a time."""

    def __init__(self) -> None:
        self.order: list[str] = []
        self.most = self._now = 0
        self._lock = threading.Lock()

    def __call__(self, shot, stop) -> Record:
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
    ended = list(run_here(shots(*[10] * 6), work, memory, at_a_time))
    assert sorted(shot.name for shot, _ in ended) == [f"shot{n}" for n in range(6)]
    assert work.most == most


def test_a_small_shot_overtakes_a_large_one(shots) -> None:
    work = Worker()
    list(run_here(shots(60, 60, 30), work, 100, 8))
    assert work.order == ["shot0", "shot2", "shot1"]


def test_leaving_early_stops_the_work(shots) -> None:
    def wait(shot, stop) -> Record:
        if shot.name != "shot0":
            assert stop.wait(10)
        return DONE

    began = time.monotonic()
    for _ in run_here(shots(1, 1), wait, 10, 2):
        break
    assert time.monotonic() - began < 5
