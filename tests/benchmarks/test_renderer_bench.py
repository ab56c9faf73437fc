"""``python -m benchmarks.renderer``: the figures of a stage, and peers that fail or are wrong."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.renderer import __main__ as bench
from benchmarks.renderer import worker
from benchmarks.renderer.peers import OURS, PEERS
from benchmarks.renderer.scene import PLUME, bench_scene


@pytest.fixture
def peers(monkeypatch):
    """No processes: Dr.Jit is Smokelift, the paper is it with an error; Mitsuba fails or is not installed.

    The n-th run of Smokelift takes n ms an iteration, as on a machine that gets busier; the peers take 60.
    """
    for key in ("drjit", "paper", "mitsuba-16"):
        monkeypatch.setitem(PEERS, key, replace(PEERS[key], packages=()))
    monkeypatch.setitem(PEERS, "mitsuba-1", replace(PEERS["mitsuba-1"], packages=("no_such_package",)))
    runs = itertools.count(1)

    def run_here(peer: str, folder: Path, lights: int, device: str) -> worker.Result:
        assert device == "cpu"
        if peer == "mitsuba-16":
            return worker.Result(failure="Out of memory.")
        scene = bench_scene(np.load(folder / "density.npy"), np.load(folder / "target.npy"), lights)
        result, image, gradient = worker.measure(OURS, scene)
        np.save(folder / "image.npy", image)
        np.save(folder / "gradient.npy", gradient * (1.01 if peer == "paper" else 1))
        return replace(result, seconds=(1e-3 * next(runs) if peer == OURS else 0.06,) * 5)

    monkeypatch.setattr(bench, "run_apart", run_here)


def test_peers_are_paired_and_scored(peers, tmp_path):
    rows = bench.Stage(tmp_path, 8, PLUME, "cpu").compare(["drjit", "paper", "mitsuba-16", "mitsuba-1"])
    ours, right, wrong, failed, missing = rows
    assert ours.image_error < 1e-6 and ours.gradient_error < bench.EXACT
    assert ours.result.seconds == pytest.approx([1e-3] * 5 + [2e-3] * 5 + [3e-3] * 5)
    assert ours.result.milliseconds == pytest.approx(2)
    assert right.ratio == pytest.approx(60 / 1.5)
    assert wrong.ratio == pytest.approx(60 / 2.5)
    assert wrong.gradient_error == pytest.approx(0.01, rel=0.01)
    assert failed.result.failure == "Out of memory."
    assert missing.result.failure == "not installed: pip install no_such_package"
    assert ours.cells(8, 0.5)[3] == "4"
    assert "not exact" in wrong.cells(8, 0.5)[-1]
