"""Costs: what a run takes; a grid that does not fit is refused before it is made, with one that fits."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import pytest

from smokelift.app import cost
from smokelift.app.cost import NotEnoughMemoryError, estimate_cost, memory_needed, require_memory
from smokelift.scene import Domain
from smokelift.setup.settings import Settings

DETAILED = Settings.preset()
SMOOTH = replace(DETAILED, detail=0.0)
FRAMES = 24
MEASURED = {(64, 64, 96): 219, (96, 96, 144): 325, (128, 128, 192): 504}
"""Peaks (MiB) of runs with half of the voxels in the hull, docs/experiments/memory-and-time.md."""

DOMAINS = {
    "cube": Domain((-1, -1, 0), (1, 1, 2), (128, 128, 128)),
    "paper": Domain((-1, -1, 0), (1, 1, 3), (128, 128, 192)),
    "odd": Domain((0, 0, 0), (1, 1.2, 2.2), (100, 120, 220)),
}


def free(monkeypatch: pytest.MonkeyPatch, gigabytes: float) -> None:
    there = SimpleNamespace(available=int(gigabytes * 2**30))
    monkeypatch.setattr(cost.psutil, "virtual_memory", lambda: there)


def suggestion(domain: Domain) -> tuple[int, int, int]:
    with pytest.raises(NotEnoughMemoryError) as caught:
        require_memory(domain, FRAMES, DETAILED)
    found = re.search(r"--resolution (\d+),(\d+),(\d+)", str(caught.value))
    assert found
    x, y, z = (int(count) for count in found.groups())
    return x, y, z


def test_more_voxels_need_more() -> None:
    """Eight times the voxels need up to eight times the memory, and nothing is free."""
    least, small, large = (memory_needed((n, n, n), FRAMES, SMOOTH) for n in (8, 128, 256))
    assert least > 0
    assert 2 * small < large < 8 * small


@pytest.mark.parametrize(("size", "mebibytes"), MEASURED.items(), ids=str)
def test_the_forecast_covers_what_was_measured(size, mebibytes) -> None:
    """With detail; by less than a half more where half of the box may hold smoke."""
    forecast = memory_needed(size, FRAMES, DETAILED) / 2**20
    assert mebibytes < forecast < 1.5 * mebibytes


def test_a_large_grid_fits_a_large_machine() -> None:
    """512 x 512 x 768 voxels within 24 GB, unless the velocity has as many."""
    large, coarsened = (512, 512, 768), replace(DETAILED.velocity, coarsening=0)
    assert memory_needed(large, FRAMES, DETAILED) < 24e9
    assert memory_needed(large, FRAMES, replace(DETAILED, velocity=coarsened)) > 48e9


def test_what_fits_is_accepted(monkeypatch) -> None:
    """No word if there is room."""
    free(monkeypatch, 64)
    require_memory(DOMAINS["paper"], FRAMES, DETAILED)


@pytest.mark.parametrize("domain", DOMAINS.values(), ids=DOMAINS.keys())
@pytest.mark.parametrize("gigabytes", [0.3, 0.34, 0.38])
def test_the_suggestion_fits(monkeypatch, domain, gigabytes) -> None:
    """The named resolution is accepted at once, and is smaller than what was refused."""
    free(monkeypatch, gigabytes)
    smaller = suggestion(domain)
    assert memory_needed(smaller, FRAMES, DETAILED) <= gigabytes * 2**30
    assert all(a < b for a, b in zip(smaller, domain.resolution, strict=True))


@pytest.mark.parametrize("domain", DOMAINS.values(), ids=DOMAINS.keys())
@pytest.mark.parametrize("gigabytes", [0.3, 0.34, 0.38])
def test_the_suggestion_has_the_same_shape(monkeypatch, domain, gigabytes) -> None:
    """It can be given as it is: the voxels of a calibrated domain stay cubes."""
    free(monkeypatch, gigabytes)
    assert replace(domain, resolution=suggestion(domain)).voxel_size > domain.voxel_size


def test_a_box_that_was_found_follows_its_voxels(monkeypatch) -> None:
    """Nearly all that fits is suggested, where a given box can only be divided evenly."""
    free(monkeypatch, 8)
    large = replace(DOMAINS["paper"], resolution=(516, 516, 948), max=(1, 1, 2 * 948 / 516))
    sizes = []
    for given in (True, False):
        with pytest.raises(NotEnoughMemoryError) as caught:
            require_memory(large, FRAMES, DETAILED, given=given)
        x, y, z = (int(n) for n in str(caught.value).rpartition(" ")[2].strip(".").split(","))
        assert memory_needed((x, y, z), FRAMES, DETAILED) <= 8 * 2**30
        assert x / z == pytest.approx(516 / 948, rel=0.02)
        sizes.append(z)
    assert sizes[0] < sizes[1]
    assert memory_needed((x + 8, y + 8, z + 8), FRAMES, DETAILED) > 8 * 2**30


def test_the_sentence_says_how_much(monkeypatch) -> None:
    """What is wanted, what is needed and what is free."""
    free(monkeypatch, 0.4)
    with pytest.raises(MemoryError, match=r"128 x 128 x 192 voxels need about 0\.5 GiB .* 0\.4 GiB are free"):
        require_memory(DOMAINS["paper"], FRAMES, SMOOTH)


def test_nothing_fits_is_said_too(monkeypatch) -> None:
    """With less memory than the bare program takes no resolution is promised to fit."""
    free(monkeypatch, 0.2)
    with pytest.raises(NotEnoughMemoryError) as caught:
        require_memory(DOMAINS["cube"], FRAMES, DETAILED)
    assert "the largest that fits" not in str(caught.value)


def test_more_frames_views_and_voxels_cost_more() -> None:
    """Time and disk follow them; without detail memory follows the voxels only."""
    base = estimate_cost(DOMAINS["cube"], 10, SMOOTH)
    longer = estimate_cost(DOMAINS["cube"], 1000, SMOOTH)
    assert longer.disk == 100 * base.disk == 1000 * 128**3 * 8
    assert longer.memory == base.memory < estimate_cost(DOMAINS["paper"], 10, SMOOTH).memory
    assert longer.seconds > 10 * base.seconds
    assert estimate_cost(DOMAINS["cube"], 1000, SMOOTH, further_views=20).seconds > 2 * longer.seconds


def test_detail_costs_time_and_memory(monkeypatch) -> None:
    """Memory for every frame, since it comes from all of them; nothing on disk."""
    monkeypatch.setattr(cost, "_solve_seconds", lambda resolution: 0.01)
    smooth, detailed = (estimate_cost(DOMAINS["cube"], 1000, settings) for settings in (SMOOTH, DETAILED))
    assert 1.3 * smooth.seconds < detailed.seconds < 2 * smooth.seconds
    assert smooth.memory < memory_needed((128, 128, 128), 10, DETAILED) < detailed.memory
    assert detailed.disk == smooth.disk
