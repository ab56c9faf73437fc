"""``python -m benchmarks.renderer``: the figures of a stage, and peers that fail or are wrong."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.renderer import __main__ as bench
from benchmarks.renderer import worker
from benchmarks.renderer.peers import OURS
from benchmarks.renderer.scene import PLUME


class Here(bench.Stage):
    """No processes: Dr.Jit is Smokelift, the paper is it with an error, and Mitsuba fails.

    The n-th run of Smokelift takes n ms an iteration, as on a machine that gets busier; the peers take 60.
    """

    runs = 0

    def run(self, peer: str, lights: int = 1) -> worker.Result:
        if peer == "mitsuba-16":
            return worker.Result(failure="Out of memory.")
        result, image, gradient = worker.measure(OURS, self._scene)
        np.save(self._folder / "image.npy", image)
        np.save(self._folder / "gradient.npy", gradient * (1.01 if peer == "paper" else 1))
        self.runs += peer == OURS
        return replace(result, seconds=(1e-3 * self.runs if peer == OURS else 0.06,) * 5)


def test_peers_are_paired_and_scored(tmp_path):
    ours, right, wrong, failed = Here(tmp_path, 8, PLUME, "cpu").compare(["drjit", "paper", "mitsuba-16"])
    assert ours.image_error < 1e-6 and ours.gradient_error < bench.EXACT
    assert ours.result.seconds == pytest.approx([1e-3] * 5 + [2e-3] * 5 + [3e-3] * 5)
    assert ours.result.milliseconds == pytest.approx(2)
    assert right.ratio == pytest.approx(60 / 1.5)
    assert wrong.ratio == pytest.approx(60 / 2.5)
    assert wrong.gradient_error == pytest.approx(0.01, rel=0.01)
    assert failed.result.failure == "Out of memory."
