"""What a worker of a cluster makes of how a shot ended."""

import importlib.util
import threading
from dataclasses import replace

import pytest

from smokelift.batch import BatchShot, Record

if importlib.util.find_spec("distributed") is None:
    pytest.skip("Dask distributed is not installed", allow_module_level=True)

from distributed import Reschedule

from smokelift.batch import worker

DONE = Record(of={}, status="done")


def test_a_shot_that_ended_is_returned(make_shot) -> None:
    assert worker.work(make_shot(), lambda shot, stop: DONE, "a") == DONE


def test_a_crash_is_an_error_that_dask_tries_again(make_shot) -> None:
    crashed = replace(DONE, status="crashed")
    with pytest.raises(worker.ShotCrashedError) as caught:
        worker.work(make_shot(), lambda shot, stop: crashed, "a")
    assert caught.value.record == crashed


def test_storage_that_fails_is_no_lost_connection(make_shot) -> None:
    def fail(_shot: BatchShot, _stop: threading.Event) -> Record:
        raise OSError("Read-only file system")

    record = worker.work(make_shot(), fail, "a")
    assert (record.status, record.sentence.endswith(": Read-only file system")) == ("stuck", True)


def test_a_batch_that_is_stopped_takes_no_more(make_shot) -> None:
    worker.stop_batch("b")
    seen = []
    worker.work(make_shot(), lambda shot, stop: seen.append(stop.is_set()) or DONE, "b")
    worker.work(make_shot(), lambda shot, stop: seen.append(stop.is_set()) or DONE, "c")
    assert seen == [True, False]


def test_a_worker_that_ends_gives_its_shot_back(make_shot, monkeypatch) -> None:
    monkeypatch.setattr(worker, "_CLOSING", threading.Event())

    def end(_shot: BatchShot, stop: threading.Event) -> Record:
        worker.EndShots().teardown(None)
        assert stop.is_set()
        return replace(DONE, status="cancelled")

    with pytest.raises(Reschedule):
        worker.work(make_shot(), end, "d")
