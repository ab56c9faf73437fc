"""Every peer that is installed gives the right image and gradient; in a process of its own, as frameworks like it."""

import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import process
from benchmarks.renderer import peers, reference, worker
from benchmarks.renderer.__main__ import EXACT
from benchmarks.renderer.peers import OURS, PEERS, Peer
from benchmarks.renderer.scene import bench_scene, plume

SIZE = 9
ONCE = """
import sys, numpy as np
from benchmarks.renderer import worker
from smokelift.render.device import start
from benchmarks.renderer.scene import bench_scene
peer, folder = sys.argv[1:]
start("cpu")
scene = bench_scene(np.load(folder + "/density.npy"), np.load(folder + "/target.npy"))
step = worker.prepare_function(peer)(scene)
image, gradient = step.download(*step.run(step.upload(scene.density)))
np.savez(folder + "/out.npz", image=image, gradient=gradient)
"""


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


def once(peer: str, folder: Path) -> dict[str, np.ndarray]:
    command = [sys.executable, "-c", ONCE, peer, str(folder)]
    ended = subprocess.run(command, env=process.environment(), capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return dict(np.load(folder / "out.npz"))


def test_exact_peer(stage):
    if needs := PEERS["drjit"].needs:
        pytest.skip(needs)
    folder, scene = stage
    out = once("drjit", folder)
    image, gradient = reference.image_and_gradient(scene)
    assert distance(out["image"], image) < 1e-6
    assert distance(out["gradient"], gradient) < EXACT / 10


def test_a_peer_says_what_it_needs(monkeypatch):
    """Dr.Jit aborts the process where it finds no LLVM, so that is asked before."""
    python = Peer("a module that there is", "ours", ("numpy",))
    monkeypatch.setattr(peers, "finds_llvm", lambda: True)
    assert not python.needs and not PEERS[OURS].needs
    assert replace(python, packages=("nowhere",)).needs == "not installed: pip install nowhere"
    monkeypatch.setattr(peers, "finds_llvm", lambda: False)
    assert python.needs.startswith("Dr.Jit finds no LLVM") and not PEERS[OURS].needs


def test_paper_has_nearly_the_image_and_another_derivative(stage):
    folder, scene = stage
    out = once("paper", folder)
    image, gradient = reference.image_and_gradient(scene)
    assert distance(out["image"], image) < 0.2
    assert distance(out["gradient"], gradient) > EXACT


def test_mitsuba_sees_the_same_smoke(stage):
    if needs := PEERS["mitsuba-16"].needs:
        pytest.skip(needs)
    folder, scene = stage
    result = worker.run_apart("mitsuba-16", folder)
    assert not result.failure
    image = reference.image(replace(scene, background=(0.0, 0.0, 0.0)))
    # 16 samples are noisy pixel by pixel; their sum is not
    assert np.load(folder / "image.npy").sum() == pytest.approx(image.sum(), rel=0.1)


def test_worker_measures_in_a_process_of_its_own(stage):
    folder, scene = stage
    result = worker.run_apart(OURS, folder)
    assert result.failure == ""
    assert worker.MIN_RUNS <= len(result.seconds) <= worker.MAX_RUNS
    assert min(result.seconds) > 0
    if sys.platform == "linux":
        assert result.peak_bytes is not None
        assert result.peak_bytes < 2**26
    image, gradient = reference.image_and_gradient(scene)
    assert distance(np.load(folder / "image.npy"), image) < 1e-6
    assert distance(np.load(folder / "gradient.npy"), gradient) < EXACT / 10


def test_failure_in_a_peer_is_one_sentence(stage):
    folder, _ = stage
    np.save(folder / "target.npy", np.zeros((3, 2, 1), np.float32))
    result = worker.run_apart(OURS, folder)
    assert result.seconds == ()
    assert "broadcast" in result.failure
    assert "\n" not in result.failure


@pytest.mark.parametrize(
    ("status", "words"), [(-signal.SIGKILL, "memory"), (-signal.SIGSEGV, "SIGSEGV"), (3, "status 3")]
)
def test_a_process_that_says_nothing(stage, monkeypatch, status, words):
    folder, _ = stage
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: subprocess.CompletedProcess((), status))
    assert words in worker.run_apart(OURS, folder).failure
