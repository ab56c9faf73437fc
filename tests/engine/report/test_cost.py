"""Costs: what a run takes; a grid that does not fit is refused before it is made, with one that fits."""

import re
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import pytest

from smokelift import Clip, Domain, Settings, Shot, prepare_shot
from smokelift.density import RoundDepth, ViewSet
from smokelift.pipeline import Reconstruction, compose
from smokelift.report import cost

WORK = cost.Workload(
    Settings.preset(), frames=24, views=1, pixels=512 * 768, smoky_max=0.4, smoky_mean=0.2, prepared=3.0
)
EXAMPLE, BUILT_IN, FULL_HD = 256 * 384, 512 * 768, 1920 * 1080
MEASURED = [
    ((48, 48, 72), EXAMPLE, 0.073, 182, 13),
    ((72, 72, 128), FULL_HD, 0.079, 587, None),
    ((140, 140, 252), FULL_HD, 0.060, 890, None),
    ((128, 128, 192), BUILT_IN, 0.339, 544, 261),
    ((192, 192, 288), BUILT_IN, 0.122, None, 346),
    ((256, 256, 384), BUILT_IN, 0.008, 556, 332),
    ((360, 360, 540), EXAMPLE, 0.173, 2589, None),
    ((480, 480, 720), 1024 * 1536, 0.0055, 2026, None),
]
"""Voxels, pixels, fraction that may hold smoke, peak (MiB) and processor time of a frame (in the time of a solve for a
million voxels) of runs, docs/experiments/memory-and-time.md."""

CUBE = (128, 128, 128)


@pytest.fixture
def free(monkeypatch):
    """Set the free memory in GiB."""
    return lambda gigabytes: monkeypatch.setattr(
        cost.psutil, "virtual_memory", lambda: SimpleNamespace(available=int(gigabytes * 2**30))
    )


@pytest.fixture
def seconds(monkeypatch):
    """Forecast the seconds of a run on a cube, on a machine of known speed."""
    monkeypatch.setattr(cost, "_seconds_per_voxel", lambda: 1e-8)
    return lambda work=WORK: cost.estimate_cost(CUBE, work).seconds


def suggestion(resolution: tuple[int, int, int], given: bool = True) -> tuple[int, int, int]:
    with pytest.raises(cost.NotEnoughMemoryError) as caught:
        cost.require_memory(resolution, WORK, given=given)
    found = re.search(r"resolution that fits is (\d+),(\d+),(\d+)", str(caught.value))
    assert found
    x, y, z = (int(count) for count in found.groups())
    return x, y, z


@pytest.mark.parametrize(("size", "pixels", "fraction", "mebibytes", "million_solves"), MEASURED)
def test_the_forecast_covers_what_was_measured(size, pixels, fraction, mebibytes, million_solves) -> None:
    work = replace(WORK, pixels=pixels, smoky_max=fraction, smoky_mean=fraction)
    if mebibytes:
        assert 0.97 * mebibytes < cost.memory_needed(size, work) / 2**20 < 1.5 * mebibytes
    if million_solves:
        per_frame = cost.voxel_solves(size, replace(work, frames=11)) - cost.voxel_solves(
            size, replace(work, frames=10)
        )
        assert million_solves / 1.5 < per_frame / 1e6 < 1.5 * million_solves


@pytest.mark.parametrize("size", [CUBE, (128, 128, 192), (100, 120, 220)])
def test_the_suggestion_fits(free, size) -> None:
    free(0.35)
    smaller = suggestion(size)
    assert cost.memory_needed(smaller, WORK) <= 0.35 * 2**30
    cost.require_memory(smaller, WORK)
    x, y, z = (n / 100 for n in size)
    assert Domain((0, 0, 0), (x, y, z), smaller).voxel_size > 0.01, "voxels of a calibrated domain stay cubes"
    free(0.2)
    with pytest.raises(cost.NotEnoughMemoryError):
        cost.require_memory(size, WORK)


def test_a_box_that_was_found_follows_its_voxels(free) -> None:
    free(7)
    coarse, (x, y, z) = (suggestion((516, 516, 948), given) for given in (True, False))
    assert x / z == pytest.approx(516 / 948, rel=0.02)
    assert z > coarse[2]
    assert cost.memory_needed((x, y, z), WORK) <= 7 * 2**30 < cost.memory_needed((x + 8, y + 8, z + 8), WORK)


def test_more_frames_views_smoke_and_detail_cost_more(seconds) -> None:
    thicker = replace(WORK, smoky_mean=2 * WORK.smoky_mean, smoky_max=2 * WORK.smoky_max)
    base, longer, more = (cost.estimate_cost(CUBE, work) for work in (WORK, replace(WORK, frames=240), thicker))
    assert longer.disk == pytest.approx(10 * base.disk)
    assert longer.memory == base.memory < more.memory
    assert longer.seconds > 8 * base.seconds
    assert 1.3 * base.seconds < more.seconds
    assert more.disk == pytest.approx(2 * base.disk)
    assert seconds(replace(WORK, views=21)) > 2 * base.seconds
    smooth = seconds(replace(WORK, settings=replace(WORK.settings, detail=0.0)))
    assert 1.5 * smooth < base.seconds < 2.5 * smooth
    fine = replace(WORK.settings, velocity=replace(WORK.settings.velocity, coarsening=0))
    assert cost.memory_needed(CUBE, replace(WORK, settings=fine)) > 1.5 * base.memory
    paper = replace(WORK, settings=Settings.preset(method="paper"), smoky_max=1.0, smoky_mean=1.0)
    assert seconds(paper) > 5 * smooth


def test_what_preparing_took_is_taken_again(seconds) -> None:
    assert seconds(replace(WORK, prepared=50.0)) - seconds() == pytest.approx(47)
    small, large = (cost.estimate_cost(CUBE, replace(WORK, peak=peak)).memory for peak in (2**20, 2**40))
    assert (small, large) == (cost.memory_needed(CUBE, WORK), 2**40)


def test_the_machine_is_timed_by_its_processor(monkeypatch) -> None:
    clock = iter([10.0, 18.0])
    monkeypatch.setattr(cost.time, "process_time", lambda: next(clock))
    solved = cost.WORKERS * cost.TIMED_SOLVES * 64**3
    assert cost._seconds_per_voxel.__wrapped__() == pytest.approx(8 / solved)


# how many voxels may hold smoke

SMOOTH = replace(Settings.preset("draft"), detail=0.0)


@pytest.fixture(scope="module")
def shot(plume) -> Iterator[Shot]:
    with Clip.open(plume.scene.clip) as clip:
        yield prepare_shot(clip, plume.scene, SMOOTH)


def test_the_fraction_that_may_hold_smoke_is_that_of_the_run(shot) -> None:
    found = cost.Workload.of(shot, SMOOTH, cost.moment())
    fractions = [frame.figures["hull_share"] for frame in Reconstruction(shot, compose(shot.settings))]
    assert found.smoky_max == pytest.approx(max(fractions), rel=0.02)
    assert found.smoky_mean == pytest.approx(sum(fractions) / len(fractions), rel=0.1)
    assert (found.frames, found.views, found.pixels) == (len(fractions), 1, 40 * 56)
    one, none = (cost.Workload.of(replace(shot, smoky=shot.smoky[:n]), SMOOTH, cost.moment()) for n in (1, 0))
    assert one.smoky_mean == pytest.approx(one.smoky_max / shot.length)
    assert none.smoky_max == none.smoky_mean == 0
    paper = cost.Workload.of(shot, Settings.preset(method="paper"), cost.moment())
    assert paper.smoky_max == 1, "the paper's densities are anywhere"


def test_what_a_busy_machine_took_longer_does_not_count(shot) -> None:
    passed, worked = cost.moment()
    for began in ((passed - 90, worked - 20), (passed - 20, worked - 90)):  # the latter on several cores
        assert cost.Workload.of(shot, SMOOTH, began).prepared == pytest.approx(20, abs=10)


def test_a_large_grid_is_measured_on_a_coarse_one(shot) -> None:
    domain = replace(shot.scene.domain, resolution=tuple(4 * n for n in shot.scene.domain.resolution))
    large = replace(shot, optics=replace(shot.optics, domain=domain))
    assert max(domain.resolution) > cost.MAX_SIDE_VOXELS
    seen, prior = ViewSet.of(large.observe(large.smoky[0]), large.optics), RoundDepth().of_clip(large)
    own = float(prior.estimate(seen).views.hull.mean())
    assert 1 < cost.Workload.of(replace(large, smoky=large.smoky[:1]), SMOOTH, cost.moment()).smoky_max / own < 1.4
