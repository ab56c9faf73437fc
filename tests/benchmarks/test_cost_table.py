"""``python -m benchmarks.pipeline.cost``: what a voxel costs, how that grows, and where it stops."""

import math

import pytest

from benchmarks.pipeline.cost import Law, exponents, text
from benchmarks.pipeline.worker import Run

SIZES = ((16, 16, 24), (32, 32, 48), (64, 64, 96))


def _runs(memory, seconds):
    """Runs at two shares, whose costs are functions of the voxels and the share of them that may hold smoke."""
    pairs = [(size, share) for share in (0.1, 0.4) for size in SIZES]
    return [
        Run(
            size,
            "default",
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


def test_the_table_says_where_it_stops():
    runs = _runs(lambda n, share: 300 + 1e-4 * n, lambda n, share: 1e-6 * n)
    runs.append(Run((999, 999, 999), "default", failure="Out of memory."))
    found = text(runs, limit=1.0)
    assert "| 999x999x999 | Out of memory. |" in found
    assert "300 MiB, 105 bytes a voxel, 0 more" in found
    assert "Time grows as voxels^1.00 share^0.00." in found
    assert "1 GiB hold 7 million voxels of which 40 %" in found


def test_one_size_has_no_slope():
    assert "Memory:" not in text([Run(SIZES[0], "default", seconds=1.0, memory_mib=300.0)], limit=1.0)
