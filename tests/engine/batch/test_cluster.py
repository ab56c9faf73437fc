"""A batch on a cluster of several processes: nothing lost and nothing done twice, whatever of it is lost."""

import importlib.util
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import SimpleNamespace

import pytest

import smokelift
from smokelift.batch.shots import BatchShot, Record

if importlib.util.find_spec("distributed") is None:
    pytest.skip("Dask distributed is not installed", allow_module_level=True)

import distributed
from cluster_driver import run_dask

from smokelift.batch.cluster import Stop, work

posix = pytest.mark.skipif(os.name == "nt", reason="processes are killed by signals")

ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([str(Path(smokelift.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]),
    "DASK_DISTRIBUTED__COMM__RETRY__COUNT": "0",
}

SECONDS = 120.0
"""For a machine that does much else."""


class Cluster:
    """A scheduler and its workers, each a process; Dask and the engine are loaded once, before they fork."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.forks = multiprocessing.get_context("forkserver")
        self.forks.set_forkserver_preload(
            ["smokelift.batch.cluster", "distributed.cli.dask_scheduler", "distributed.cli.dask_worker"]
        )
        self.processes: list[BaseProcess] = []
        self.drivers: list[subprocess.Popen[str]] = []

    def scheduler(self) -> BaseProcess:
        return self._start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port))

    def worker(self) -> BaseProcess:
        options = ("--nthreads", "1", "--no-nanny", "--memory-limit", "0", "--local-directory", str(self.folder))
        return self._start("distributed.cli.dask_worker", self.address, *options)

    def drive(self) -> subprocess.Popen[str]:
        words = [sys.executable, str(Path(__file__).with_name("cluster_driver.py")), self.address, str(self.folder)]
        self.drivers.append(subprocess.Popen(words, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True))
        return self.drivers[-1]

    def close(self) -> None:
        for process in (*self.processes, *self.drivers):
            process.kill()
        for process in self.processes:
            process.join()
        for driver in self.drivers:
            driver.communicate()

    def _start(self, module: str, *options: str) -> BaseProcess:
        words = (module, *options, "--no-dashboard")
        process = self.forks.Process(target=run_dask, args=(self.folder / "cluster.log", words))
        process.start()
        self.processes.append(process)
        return process


@pytest.fixture
def cluster(tmp_path) -> Iterator[Cluster]:
    made = Cluster(tmp_path)
    yield made
    made.close()


@posix
def test_a_killed_worker_or_scheduler_neither_loses_nor_repeats_frames(cluster, make_shot, tmp_path, ledger, until):
    """A worker and the scheduler are killed while shots run, and the storage is full for a while."""
    full = tmp_path / "full"
    full.touch()
    shots = [make_shot(f"shot{n}", frames=9, seconds=0.05, n9=str(full), n4="crash") for n in range(3)]

    def done() -> list[int]:
        return [len(ledger(shot)) for shot in shots if shot.file("ledger").exists()]

    scheduler, first, second = cluster.scheduler(), cluster.worker(), cluster.worker()
    driver = cluster.drive()
    until(lambda: sum(done()) >= 5)
    first.kill()
    until(lambda: sum(done()) >= 10)
    scheduler.kill()
    second.join(SECONDS)  # a worker ends without its scheduler, and its shot with it
    assert not second.is_alive()
    cluster.scheduler(), cluster.worker(), cluster.worker()
    until(lambda: 8 in done())  # where the disk is full
    full.unlink()
    said, _ = driver.communicate(timeout=SECONDS)
    assert sorted(line for line in said.splitlines() if line.startswith("shot")) == [f"shot{n} done" for n in range(3)]
    assert "went away; waiting for it to return" in said
    assert [ledger(shot) for shot in shots] == [list(range(1, 10))] * 3


def test_a_worker_returns_its_shot_unless_it_ends_itself(make_shot, monkeypatch) -> None:
    """A shot that was cancelled goes to another worker."""
    plugin = Stop()
    plugin.setup(None)
    monkeypatch.setattr(distributed, "get_worker", lambda: SimpleNamespace(plugins={"batch": plugin}))

    def task(_shot: BatchShot, stop: threading.Event) -> Record:
        return Record({}, "cancelled" if stop.is_set() else "done")

    assert work(make_shot(), task, "batch").status == "done"
    plugin.teardown(None)
    with pytest.raises(distributed.Reschedule):
        work(make_shot(), task, "batch")


@posix
def test_a_batch_that_is_cancelled_ends_its_shots_at_once(cluster, make_shot, ledger, engines, until) -> None:
    shots = [make_shot(f"shot{n}", frames=1000, seconds=0.02) for n in range(2)]
    cluster.scheduler()
    driver = cluster.drive()
    assert driver.stdout is not None and driver.stdout.readline() == "began\n"
    cluster.worker()  # it begins with either shot
    until(lambda: any(shot.file("ledger").exists() for shot in shots))
    begun, other = sorted(shots, key=lambda shot: not shot.file("ledger").exists())
    driver.send_signal(signal.SIGINT)
    said, _ = driver.communicate(timeout=SECONDS)
    assert said.splitlines()[-1] == "cancelled"
    until(lambda: not (begun.folder / f".{begun.name}.lock").exists())
    assert not engines()
    assert 0 < len(ledger(begun)) < 1000
    assert not other.file("ledger").exists()
