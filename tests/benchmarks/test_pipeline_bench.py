"""``python -m benchmarks.pipeline``: what a voxel costs, how that grows, and what is timed."""

import math

import pytest

from benchmarks.machine import UNTIMED
from benchmarks.pipeline.__main__ import Law, exponents
from benchmarks.pipeline.clip import with_grid, write_clip
from benchmarks.pipeline.worker import Run, run_apart
from smokelift import Settings
from smokelift.output.vdb import VdbUnavailable, vdb_module

SHAPE = (16, 16, 24)
SIZES = ((16, 16, 24), (32, 32, 48), (64, 64, 96))


def test_laws_are_found_again():
    runs = [Run(size, occupied=fraction) for fraction in (0.1, 0.4) for size in SIZES]
    voxels = [(math.prod(run.size), run.occupied) for run in runs]
    law = Law.of(runs, [300 + 1e-4 * n + 2e-4 * fraction * n for n, fraction in voxels])
    assert (law.base, law.a_voxel, law.an_occupied) == pytest.approx((300, 1e-4, 2e-4))
    assert law.most_voxels(300 + 1.2e-4 * 5e6, 0.1) == pytest.approx(5e6)
    assert exponents(runs, [1e-6 * n**1.1 * fraction**0.3 for n, fraction in voxels]) == pytest.approx((1.1, 0.3))


def test_a_run_is_timed_in_a_process_of_its_own(tmp_path):
    try:
        vdb_module()
    except VdbUnavailable as missing:
        pytest.skip(str(missing))
    scene = write_clip(tmp_path, UNTIMED + 1, pixels=(48, 72), shape=SHAPE)
    with_grid(scene, SHAPE).save(tmp_path / "scene.toml")
    found = run_apart(tmp_path / "scene.toml", Settings.preset("draft"), SHAPE, 1, "wall")
    assert found.failure == ""
    assert 0 < found.seconds_density + found.seconds_velocity <= found.seconds
    assert found.solves > 0 and found.psnr > 30
    assert "none.toml" in run_apart(tmp_path / "none.toml", Settings.preset(), SHAPE, 1, "wall").failure
