"""``python -m benchmarks.pipeline``: what a voxel costs, how that grows, and what is timed."""

import math

import numpy as np
import pytest

from benchmarks.machine import UNTIMED
from benchmarks.pipeline import clip
from benchmarks.pipeline.__main__ import Law, exponents
from benchmarks.pipeline.clip import with_grid, write_clip
from benchmarks.pipeline.worker import Job, Run, run_apart
from benchmarks.velocity.flow import built_in_densities, built_in_pair
from smokelift.output.vdb import VdbUnavailable, vdb_module

SHAPE = (16, 16, 24)
SIZES = ((16, 16, 24), (32, 32, 48), (64, 64, 96))


def _runs(memory, seconds):
    """Runs at two fractions, whose costs are functions of the voxels and the fraction of them that may hold smoke."""
    pairs = [(size, share) for share in (0.1, 0.4) for size in SIZES]
    return [
        Run(
            size,
            seconds=seconds(math.prod(size), share),
            memory_mib=memory(math.prod(size), share),
            occupied=share,
        )
        for size, share in pairs
    ]


def test_a_law_is_found_again():
    runs = _runs(lambda n, share: 300 + 1e-4 * n + 2e-4 * share * n, lambda n, share: 1.0)
    law = Law.of(runs, [run.memory_mib or 0.0 for run in runs])
    assert law.base == pytest.approx(300)
    assert law.a_voxel == pytest.approx(1e-4)
    assert law.an_occupied == pytest.approx(2e-4)
    assert law.most_voxels(300 + 1.2e-4 * 5e6, 0.1) == pytest.approx(5e6)


def test_both_slopes_are_found_again():
    runs = _runs(lambda n, share: 1.0, lambda n, share: 1e-6 * n**1.1 * share**0.3)
    assert exponents(runs, [run.seconds for run in runs]) == (pytest.approx(1.1), pytest.approx(0.3))


@pytest.fixture
def small_pictures(monkeypatch):
    monkeypatch.setattr(clip, "PIXELS", (48, 72))
    monkeypatch.setattr(clip, "SHAPE", SHAPE)


def test_the_built_in_smoke_moves_as_its_formula_says():
    pair = built_in_pair(SHAPE, 0)
    first, second = built_in_densities(SHAPE, 0, 2)
    np.testing.assert_array_equal(first, pair.before)
    assert np.linalg.norm(second - pair.after) < 0.02 * np.linalg.norm(pair.after - pair.before)


def test_the_box_has_cubes_of_any_number_about_the_same_middle(tmp_path, small_pictures):
    scene = write_clip(tmp_path, 1)
    for shape in (SHAPE, (32, 32, 36)):
        box = with_grid(scene, shape).domain
        assert box is not None and box.resolution == shape
        assert box.centre == (0.0, 0.0, 0.0)
        assert box.max[2] - box.min[2] == pytest.approx(clip.HEIGHT)


@pytest.mark.usefixtures("small_pictures")
def test_a_run_is_timed_in_a_process_of_its_own(tmp_path):
    try:
        vdb_module()
    except VdbUnavailable as missing:
        pytest.skip(str(missing))
    with_grid(write_clip(tmp_path, UNTIMED + 1), SHAPE).save(tmp_path / "scene.toml")
    found = run_apart(Job(str(tmp_path / "scene.toml"), SHAPE, "balanced", 1.0, 1, "wall"), tmp_path)
    assert found.failure == ""
    assert 0 < found.seconds_density + found.seconds_velocity <= found.seconds
    assert found.solves > 0 and found.psnr > 30


def test_a_run_that_fails_says_why(tmp_path):
    found = run_apart(Job(str(tmp_path / "none.toml"), SHAPE, "balanced", 1.0, 1, "wall"), tmp_path)
    assert "none.toml" in found.failure
