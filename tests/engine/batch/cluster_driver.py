"""Runs shots of the fake engine on a cluster, and says of each how it ended: one line per shot.

In a process of its own, because a client that lost its scheduler leaves sockets behind, of which pytest complains.
"""

import functools
import os
import runpy
import signal
import sys
from pathlib import Path

from smokelift.batch.cluster import run_on_cluster
from smokelift.batch.shots import BatchShot
from smokelift.batch.work import finish_shot

FAKE = (sys.executable, "-S", str(Path(__file__).with_name("fake_engine.py")))


def run_dask(log: Path, words: tuple[str, ...]) -> None:
    """Be a scheduler or a worker, which says what it does in a file."""
    with log.open("a") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)
    sys.argv = list(words)
    runpy.run_module(words[0], run_name="__main__", alter_sys=True)


def main(address: str, folder: Path) -> None:
    shots = [BatchShot(path.stem, path, (), folder / "results") for path in sorted(folder.glob("*.task"))]
    task = functools.partial(finish_shot, pause=0.2, engine=FAKE)
    print("began", flush=True)
    ended = run_on_cluster(dict.fromkeys(shots, 0), task, address, functools.partial(print, flush=True))
    try:
        for shot, record in ended:
            print(shot.name, record.status, flush=True)
    except KeyboardInterrupt:
        print("cancelled", flush=True)


if __name__ == "__main__":
    # a test run in the background may ignore SIGINT, which children inherit
    signal.signal(signal.SIGINT, signal.default_int_handler)
    main(sys.argv[1], Path(sys.argv[2]))
