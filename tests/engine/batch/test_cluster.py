"""A batch on a cluster of several processes: nothing lost and nothing done twice, whatever of it is lost."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

import smokelift
from smokelift.batch.shots import BatchShot
from smokelift.batch.work import Record

if importlib.util.find_spec("distributed") is None:
    pytest.skip("Dask distributed is not installed", allow_module_level=True)

import distributed

from smokelift.batch import cluster as batch_cluster
from smokelift.batch.cluster import Stop, run_on_cluster

posix = pytest.mark.skipif(os.name == "nt", reason="processes are killed by signals")

ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([str(Path(smokelift.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]),
    "DASK_DISTRIBUTED__COMM__RETRY__COUNT": "0",
}
DONE = Record({}, "done")

SECONDS = 120.0
"""For a machine that does much else."""


class Cluster:
    """A scheduler and its workers, each a process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.processes: list[subprocess.Popen[str]] = []

    def scheduler(self) -> subprocess.Popen[str]:
        return self._start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port))

    def worker(self) -> subprocess.Popen[str]:
        options = ("--nthreads", "1", "--no-nanny", "--memory-limit", "0", "--local-directory", str(self.folder))
        return self._start("distributed.cli.dask_worker", self.address, *options)

    def drive(self) -> subprocess.Popen[str]:
        return self._process(str(Path(__file__).with_name("cluster_driver.py")), self.address, str(self.folder))

    def close(self) -> None:
        for process in self.processes:
            process.kill()
            process.communicate()

    def _start(self, module: str, *options: str) -> subprocess.Popen[str]:
        return self._process("-m", module, *options, "--no-dashboard")

    def _process(self, *words: str) -> subprocess.Popen[str]:
        with (self.folder / "cluster.log").open("a") as log:
            process = subprocess.Popen(
                [sys.executable, *words], env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=log, text=True
            )
        self.processes.append(process)
        return process


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    made = Cluster(tmp_path)
    yield made
    made.close()


def until(true: Callable[[], object]) -> None:
    """Wait for something to become true."""
    end = time.monotonic() + SECONDS
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


@posix
def test_a_killed_worker_or_scheduler_neither_loses_nor_repeats_frames(cluster, make_shot, tmp_path, ledger) -> None:
    """A worker and the scheduler are killed while shots run, and the storage is full for a while."""
    full = tmp_path / "full"
    full.touch()
    shots = [make_shot(f"shot{n}", frames=12, seconds=0.1, n9=str(full), n4="crash") for n in range(3)]

    def frames() -> int:
        return sum(len(ledger(shot)) for shot in shots if shot.file("ledger").exists())

    scheduler, first, second = cluster.scheduler(), cluster.worker(), cluster.worker()
    driver = cluster.drive()
    until(lambda: frames() >= 5)
    first.kill()
    until(lambda: frames() >= 10)
    scheduler.kill()
    second.wait(SECONDS)  # a worker ends without its scheduler, and its shot with it
    cluster.scheduler(), cluster.worker(), cluster.worker()
    until(lambda: frames() >= 16)
    full.unlink()
    said, _ = driver.communicate(timeout=SECONDS)
    assert sorted(line for line in said.splitlines() if line.startswith("shot")) == [f"shot{n} done" for n in range(3)]
    assert "went away; waiting for it to return" in said
    assert [ledger(shot) for shot in shots] == [list(range(1, 13))] * 3


@dataclass(frozen=True, eq=False)
class Given:
    """A task that a `LaterWorker` was given; done as soon as it is begun."""

    record: Record
    priority: int
    status: str = "finished"

    def result(self) -> Record:
        return self.record


class LaterWorker:
    """Dask's client before a scheduler whose only worker comes after the tasks."""

    loop = None

    def __init__(self, *_: object, **__: object) -> None:
        pass

    def __enter__(self) -> LaterWorker:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    status = "closed"

    def register_plugin(self, _: object, name: str) -> None:
        pass

    def run_on_scheduler(self, _: object) -> bool:
        return False

    def submit(self, _: object, shot: BatchShot, *__: object, priority: int = 0, **___: object) -> Given:
        return Given(DONE, priority)


def begun(tasks: list[Given], loop: None) -> list[Given]:
    """The order in which a worker begins them: by priority, and of those with the same one the last first."""
    ordered = sorted(enumerate(tasks), key=lambda given: (given[1].priority, given[0]), reverse=True)
    return [task for _, task in ordered]


def test_a_worker_that_comes_later_begins_the_shots_in_their_order(make_shot, monkeypatch) -> None:
    monkeypatch.setattr("distributed.Client", LaterWorker)
    monkeypatch.setattr("distributed.as_completed", begun)
    shots = [make_shot(name) for name in ("west", "east", "north")]
    ended = run_on_cluster([(shot, 0) for shot in shots], lambda shot, stop: DONE, "tcp://", print)
    assert [shot.name for shot, _ in ended] == ["west", "east", "north"]


@pytest.fixture
def on_worker(make_shot, monkeypatch) -> Callable[..., Record]:
    """Work on a shot by a task on a worker that has the plugin of the batch."""
    worker = SimpleNamespace(plugins={"batch": Stop()})
    worker.plugins["batch"].setup(worker)
    monkeypatch.setattr(batch_cluster.distributed, "get_worker", lambda: worker)
    return lambda task: batch_cluster.work(make_shot(), lambda shot, stop: task(worker.plugins["batch"], stop), "batch")


def test_a_shot_that_ended_is_returned(on_worker) -> None:
    assert on_worker(lambda plugin, stop: DONE) == DONE


def test_storage_that_fails_is_no_lost_connection(on_worker) -> None:
    def fail(_plugin: Stop, _stop: threading.Event) -> Record:
        raise OSError("Read-only file system")

    record = on_worker(fail)
    assert (record.status, record.sentence) == ("stuck", "Read-only file system")


def test_a_worker_that_ends_gives_its_shot_back(on_worker) -> None:
    def end(plugin: Stop, stop: threading.Event) -> Record:
        plugin.teardown(None)
        assert stop.is_set()
        return replace(DONE, status="cancelled")

    with pytest.raises(distributed.Reschedule):
        on_worker(end)


@posix
def test_a_batch_that_is_cancelled_ends_its_shots_at_once(cluster, make_shot, tmp_path, ledger) -> None:
    shots = [make_shot(f"shot{n}", frames=1000, seconds=0.02) for n in range(2)]
    cluster.scheduler(), cluster.worker()
    driver = cluster.drive()
    until(lambda: shots[0].file("ledger").exists())
    driver.send_signal(signal.SIGINT)
    said, _ = driver.communicate(timeout=SECONDS)
    assert said.splitlines()[-1] == "cancelled"
    until(lambda: not (shots[0].folder / ".shot0.lock").exists())
    there = ledger(shots[0])
    assert 0 < len(there) < 1000
    assert not shots[1].file("ledger").exists()
