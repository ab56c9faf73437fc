"""Runs real shots on a local Dask cluster, kills its parts at random moments, and counts what was lost and repeated.

    python -m benchmarks.batch FOLDER --shots 3 --workers 2 --losses 6

Every shot is the same clip with the same settings, so every frame has to be, to the bit, that of a run that nothing
disturbs. As root the folder's storage is also full for a while.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import psutil

from benchmarks.stability.environments import file_system, lacking

SCENE = Path(__file__).parents[2] / "examples" / "plume" / "scene.toml"
OPTIONS = {"quality": "draft", "resolution": "16,16,24", "npz": True}
FRAMES = (20, 39)
LOSSES = ("engine", "worker", "scheduler", "storage")
BETWEEN = (4.0, 12.0)
"""Seconds from one loss to the next."""


class Supervised:
    """A process that is started again whenever it has ended, as a service is."""

    def __init__(self, *words: str, log: Path) -> None:
        self._words, self._log = words, log
        self.process = self._started()

    def keep(self) -> None:
        """Start it again if it has ended."""
        if self.process.poll() is not None:
            self.process = self._started()

    def _started(self) -> subprocess.Popen[bytes]:
        with self._log.open("ab") as log:
            return subprocess.Popen([sys.executable, *self._words], stdout=log, stderr=log)


def main() -> None:
    """Run the ordeal and print its figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.batch")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--shots", type=int, default=3)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--losses", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--port", type=int, default=18786)
    options = parser.parse_args()
    random = np.random.default_rng(options.seed)
    folder = options.folder.resolve()
    folder.mkdir(parents=True)
    reference = run_alone(folder)
    out = folder / "results"
    with ExitStack() as stack:
        can_fill = not lacking("full disk", folder)
        remount = stack.enter_context(file_system(out, "size=64m")) if can_fill else None
        services = stack.enter_context(cluster(folder, options.port, options.workers))
        words = ["-m", "smokelift", "batch", str(write_list(folder, options.shots))]
        words += ["--scheduler", f"tcp://127.0.0.1:{options.port}"]
        with (folder / "batch.log").open("wb") as log:
            batch = subprocess.Popen([sys.executable, *words], stdout=log, stderr=log)
        began, counts = time.monotonic(), dict.fromkeys(LOSSES, 0)
        next_loss = began + 20.0
        while batch.poll() is None:
            time.sleep(0.2)
            for service in services:
                service.keep()
            if time.monotonic() < next_loss or sum(counts.values()) >= options.losses:
                continue
            what = LOSSES[sum(counts.values()) % len(LOSSES)]
            if what == "engine":
                engines = [one for one in psutil.process_iter(["cmdline"]) if is_engine(one, out)]
                if not engines:
                    continue
                engines[int(random.integers(len(engines)))].kill()
            elif what == "storage" and remount is not None:
                used = psutil.disk_usage(str(out)).used
                remount(f"size={max(used, 4096)}")
                time.sleep(8.0)
                remount("size=64m")
            elif what != "storage":
                (
                    services[0] if what == "scheduler" else services[1 + int(random.integers(options.workers))]
                ).process.kill()
            counts[what] += 1
            next_loss = time.monotonic() + float(random.uniform(*BETWEEN))
        seconds = time.monotonic() - began
        names = [f"shot{n}" for n in range(options.shots)]
        made = [frames_made(out / f"{name}.log") for name in names]
        twice = sum(len(each) - len(set(each)) for each in made)
        sums = [checksums(out / name) for name in names]
        print("lost: " + ", ".join(f"{count} x {what}" for what, count in counts.items()))
        print(f"batch: status {batch.returncode}, {seconds:.0f} s")
        print(f"frames: {len(names) * len(reference)} asked for, {sum(map(len, sums))} finished, {twice} said twice")
        print(f"shots that are those of an undisturbed run to the bit: {sums.count(reference)} of {len(names)}")


def run_alone(folder: Path) -> dict[str, str]:
    """Reconstruct the shot without a disturbance; the checksums of its NumPy files."""
    out = folder / "alone"
    words = [f"--{key}" if value is True else f"--{key}={value}" for key, value in OPTIONS.items()]
    frames = f"--frames={FRAMES[0]}:{FRAMES[1]}"
    command = [sys.executable, "-m", "smokelift", "reconstruct", str(SCENE), "--out", str(out), frames, *words]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return checksums(out)


def checksums(directory: Path) -> dict[str, str]:
    """The checksums of a sequence's NumPy files."""
    index = json.loads((directory / "sequence.json").read_text())
    return {name: digits for name, digits in index["checksums"].items() if name.endswith(".npz")}


def frames_made(log: Path) -> list[int]:
    """The frames that all runs of a shot say they finished."""
    events = [json.loads(line) for line in log.read_text().splitlines() if line.startswith('{"event": "frame"')]
    return [event["frame"] for event in events]


def write_list(folder: Path, count: int) -> Path:
    """Write the list of so many equal shots."""
    path = folder / "shots.toml"
    values = [f"{key} = {json.dumps(value)}" for key, value in {**OPTIONS, "frames": list(FRAMES)}.items()]
    shots = [f'[[shots]]\ninput = {json.dumps(str(SCENE))}\nname = "shot{n}"' for n in range(count)]
    path.write_text("\n".join(["[defaults]", *values, *shots]))
    return path


def is_engine(process: psutil.Process, out: Path) -> bool:
    """Whether a process reconstructs a shot of the batch."""
    words = process.info["cmdline"] or []
    return "smokelift_command.tethered" in words and any(word.startswith(str(out)) for word in words)


@contextmanager
def cluster(folder: Path, port: int, workers: int) -> Iterator[list[Supervised]]:
    """A scheduler, and so many workers."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    scheduler = ("-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    worker = ("-m", "distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-nanny")
    more = ("--no-dashboard", "--memory-limit", "0", "--local-directory", str(folder))
    services = [Supervised(*scheduler, log=folder / "scheduler.log")]
    services += [Supervised(*worker, *more, log=folder / f"worker{n}.log") for n in range(workers)]
    try:
        yield services
    finally:
        for service in services:
            service.process.kill()
            service.process.wait()


if __name__ == "__main__":
    main()
