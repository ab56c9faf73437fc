"""Costs: what a run takes; a grid that does not fit is refused before it is made, with one that fits."""

import re
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import psutil
import pytest

from smokelift.report import cost
from smokelift.report.cost import (
    NotEnoughMemoryError,
    Spent,
    Workload,
    estimate_cost,
    memory_needed,
    require_memory,
    voxel_solves,
)
from smokelift.scene import Domain
from smokelift.setup.settings import Settings

WORK = Workload(Settings.preset(), frames=24, views=1, pixels=512 * 768, largest=0.4, mean=0.2)
SMOOTH = replace(WORK, settings=replace(WORK.settings, detail=0.0))
EXAMPLE, BUILT_IN, FULL_HD = 256 * 384, 512 * 768, 1920 * 1080
MEMORY = [
    ((48, 48, 72), EXAMPLE, 0.073, 182),
    ((60, 60, 92), EXAMPLE, 0.221, 239),
    ((72, 72, 128), FULL_HD, 0.079, 587),
    ((140, 140, 252), FULL_HD, 0.060, 890),
    ((128, 128, 192), BUILT_IN, 0.011, 455),
    ((128, 128, 192), BUILT_IN, 0.341, 544),
    ((176, 176, 264), BUILT_IN, 0.009, 691),
    ((240, 240, 360), EXAMPLE, 0.174, 993),
    ((360, 360, 540), EXAMPLE, 0.173, 2589),
    ((256, 256, 384), BUILT_IN, 0.008, 556),
    ((480, 480, 720), 1024 * 1536, 0.0055, 2026),
]
"""Voxels, pixels, share that may hold smoke and peak (MiB) of runs, docs/experiments/memory-and-time.md."""

TIME = [
    ((48, 48, 72), 0.073, 13),
    ((128, 128, 192), 0.129, 200),
    ((128, 128, 192), 0.339, 261),
    ((192, 192, 288), 0.122, 346),
    ((256, 256, 384), 0.008, 332),
]
"""Voxels, share and processor time of a frame, in the time of a solve for a million voxels, of the same page."""

PREPARED = Spent(3.0, 3.0)

SIZES = {"cube": (128, 128, 128), "paper": (128, 128, 192), "odd": (100, 120, 220)}


def free(monkeypatch: pytest.MonkeyPatch, gigabytes: float) -> None:
    there = SimpleNamespace(available=int(gigabytes * 2**30))
    monkeypatch.setattr(cost.psutil, "virtual_memory", lambda: there)


def suggestion(resolution: tuple[int, int, int], given: bool = True) -> tuple[int, int, int]:
    with pytest.raises(NotEnoughMemoryError) as caught:
        require_memory(resolution, WORK, given=given)
    found = re.search(r"resolution that fits is (\d+),(\d+),(\d+)", str(caught.value))
    assert found
    x, y, z = (int(count) for count in found.groups())
    return x, y, z


def test_more_voxels_need_more() -> None:
    least, small, large = (memory_needed((n, n, n), WORK) for n in (8, 128, 512))
    assert least > 0
    assert 2 * small < large < 64 * small


@pytest.mark.parametrize(("size", "pixels", "share", "mebibytes"), MEMORY)
def test_the_forecast_covers_what_was_measured(size, pixels, share, mebibytes) -> None:
    forecast = memory_needed(size, replace(WORK, pixels=pixels, largest=share)) / 2**20
    assert 0.97 * mebibytes < forecast < 1.5 * mebibytes


@pytest.mark.parametrize(("size", "share", "million_solves"), TIME)
def test_a_frame_takes_what_was_measured(size, share, million_solves) -> None:
    shorter, longer = (replace(WORK, frames=frames, mean=share) for frames in (10, 11))
    a_frame = voxel_solves(size, longer) - voxel_solves(size, shorter)
    assert million_solves / 1.5 < a_frame / 1e6 < 1.5 * million_solves


def test_a_voxel_a_pixel_fits_where_smoke_fills_little() -> None:
    """A plume of 1080p takes 7 GB; the same box full of smoke does not fit, nor does a velocity as fine."""
    large, plume = (524, 524, 952), replace(WORK, pixels=FULL_HD, largest=0.05)
    coarsened = replace(plume.settings, velocity=replace(plume.settings.velocity, coarsening=0))
    assert 5e9 < memory_needed(large, plume) < 8e9
    assert memory_needed(large, replace(plume, largest=1.0)) > 60e9
    assert memory_needed(large, replace(plume, settings=coarsened)) > 40e9


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES.keys())
@pytest.mark.parametrize("gigabytes", [0.3, 0.35, 0.4])
def test_the_suggestion_fits(monkeypatch, size, gigabytes) -> None:
    free(monkeypatch, gigabytes)
    smaller = suggestion(size)
    assert memory_needed(smaller, WORK) <= gigabytes * 2**30
    assert all(a < b for a, b in zip(smaller, size, strict=True))
    require_memory(smaller, WORK)
    x, y, z = (n / 100 for n in size)
    assert Domain((0, 0, 0), (x, y, z), smaller).voxel_size > 0.01, "voxels of a calibrated domain stay cubes"


def test_a_box_that_was_found_follows_its_voxels(monkeypatch) -> None:
    free(monkeypatch, 7)
    large = (516, 516, 948)
    sizes = []
    for given in (True, False):
        x, y, z = suggestion(large, given)
        assert memory_needed((x, y, z), WORK) <= 7 * 2**30
        assert x / z == pytest.approx(516 / 948, rel=0.02)
        sizes.append(z)
    assert sizes[0] < sizes[1]
    assert memory_needed((x + 8, y + 8, z + 8), WORK) > 7 * 2**30


def test_nothing_fits_is_said_too(monkeypatch) -> None:
    free(monkeypatch, 0.2)
    with pytest.raises(NotEnoughMemoryError) as caught:
        require_memory(SIZES["cube"], WORK)
    assert "resolution that fits" not in str(caught.value)


def test_more_frames_views_and_smoke_cost_more(monkeypatch) -> None:
    monkeypatch.setattr(cost, "_seconds_a_voxel", lambda: 1e-8)
    base, longer, more = (
        estimate_cost(SIZES["cube"], work, PREPARED)
        for work in (WORK, replace(WORK, frames=240), replace(WORK, mean=2 * WORK.mean, largest=2 * WORK.largest))
    )
    assert longer.disk == pytest.approx(10 * base.disk)
    assert longer.memory == base.memory < more.memory
    assert longer.seconds > 8 * base.seconds
    assert 1.3 * base.seconds < more.seconds
    assert more.disk == pytest.approx(2 * base.disk)
    assert estimate_cost(SIZES["cube"], replace(WORK, views=21), PREPARED).seconds > 2 * base.seconds


def test_preparing_takes_as_long_again(monkeypatch) -> None:
    """A clip may take long to prepare; how long it waits for a busy machine tells nothing of the run."""
    monkeypatch.setattr(cost, "_seconds_a_voxel", lambda: 1e-8)
    quick, slow, busy = (
        estimate_cost(SIZES["cube"], WORK, Spent(seconds, processor)).seconds
        for seconds, processor in ((3.0, 3.0), (50.0, 50.0), (15.0, 3.0))
    )
    assert slow - quick == pytest.approx(47)
    assert busy == quick
    both_cores = estimate_cost(SIZES["cube"], WORK, Spent(3.0, 5.0)).seconds
    assert both_cores == quick, "two cores work at a time"


def test_a_run_takes_the_memory_that_preparing_took(monkeypatch) -> None:
    monkeypatch.setattr(cost, "_seconds_a_voxel", lambda: 1e-8)
    small, large = (
        estimate_cost(SIZES["cube"], WORK, replace(PREPARED, memory=peak)).memory for peak in (2**20, 2**40)
    )
    assert (small, large) == (memory_needed(SIZES["cube"], WORK), 2**40)


def test_time_without_detail_and_of_the_papers_method(monkeypatch) -> None:
    monkeypatch.setattr(cost, "_seconds_a_voxel", lambda: 1e-8)
    paper = replace(SMOOTH, settings=Settings.preset(method="paper"), largest=1.0, mean=1.0)
    detailed, smooth, papers = (estimate_cost(SIZES["cube"], work, PREPARED).seconds for work in (WORK, SMOOTH, paper))
    assert 1.5 * smooth < detailed < 2.5 * smooth
    assert papers > 5 * smooth


def test_other_work_on_the_machine_does_not_change_a_forecast() -> None:
    """Three busy programs for each processor make a solve take several times as long, and no more of the processor."""
    alone = cost._seconds_a_voxel.__wrapped__()
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3 * (psutil.cpu_count() or 1))]
    try:
        beside = cost._seconds_a_voxel.__wrapped__()
    finally:
        for program in busy:
            program.kill()
            program.wait()
    assert beside == pytest.approx(alone, rel=0.6)
