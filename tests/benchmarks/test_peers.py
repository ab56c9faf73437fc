"""Every peer that is installed gives the right image and gradient; in a process of its own, as frameworks like it."""

import os
import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.process import apart
from benchmarks.renderer import reference, worker
from benchmarks.renderer.__main__ import EXACT
from benchmarks.renderer.peers import OURS, PEERS
from benchmarks.renderer.scene import bench_scene, plume

SIZE = 9


@pytest.fixture
def stage(tmp_path):
    """A folder with a scene without a single empty voxel, so that borders count too, and the scene."""
    target = np.random.default_rng(0).random((SIZE, SIZE, 3), np.float32)
    scene = bench_scene(plume(SIZE, 1.0), target)
    np.save(tmp_path / "density.npy", scene.density)
    np.save(tmp_path / "target.npy", target)
    return tmp_path, scene


def distance(values: np.ndarray, truth: np.ndarray) -> float:
    assert values.shape == truth.shape
    return float(np.linalg.norm(values - truth) / np.linalg.norm(truth))


@pytest.mark.parametrize("peer", [OURS, "drjit", "paper", "mitsuba-16"])
def test_a_peer_is_measured_in_a_process_of_its_own(stage, peer):
    if needs := PEERS[peer].needs:
        pytest.skip(needs)
    folder, scene = stage
    result = worker.run_apart(peer, folder)
    assert result.failure == "" and min(result.seconds) > 0
    assert worker.MIN_RUNS <= len(result.seconds) <= worker.MAX_RUNS
    if sys.platform == "linux" and peer == OURS:
        assert result.peak_bytes is not None and result.peak_bytes < 2**26
    found, gradient = (np.load(folder / f"{name}.npy") for name in ("image", "gradient"))
    if peer == "mitsuba-16":  # 16 samples are noisy pixel by pixel; their sum is not
        assert found.sum() == pytest.approx(reference.image(replace(scene, background=(0.0, 0.0, 0.0))).sum(), rel=0.1)
        return
    image, true_gradient = reference.image_and_gradient(scene)
    assert distance(found, image) < (0.2 if peer == "paper" else 1e-6)
    assert (distance(gradient, true_gradient) < EXACT / 10) == (peer != "paper")


def test_failure_in_a_peer_is_one_sentence(stage):
    folder, _ = stage
    np.save(folder / "target.npy", np.zeros((3, 2, 1), np.float32))
    result = worker.run_apart(OURS, folder)
    assert result.seconds == ()
    assert "broadcast" in result.failure and "\n" not in result.failure


def test_a_process_that_crashes_says_so():
    assert apart(os.abort).startswith("Crashed")
