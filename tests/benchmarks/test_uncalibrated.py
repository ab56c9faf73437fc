"""What a reconstruction shows where it was filmed from: the input view, and the pattern of a wall in the smoke."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.accuracy.uncalibrated import front_figures, pattern_figures

ROWS, COLUMNS = 90, 60


@pytest.fixture(scope="module")
def cloth() -> np.ndarray:
    """A pattern with spots some pixels wide."""
    noise = np.random.default_rng(4).standard_normal((ROWS, COLUMNS))
    spots = ndimage.gaussian_filter(noise, 2.0)
    return np.repeat((0.4 + 0.1 * spots / spots.std())[..., None], 3, -1).astype(np.float32)


def smoke(seed: int) -> np.ndarray:
    """Share of the light that a blob of smoke with a structure of its own lets through."""
    down, right = np.mgrid[:ROWS, :COLUMNS]
    structure = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((ROWS, COLUMNS)), 2.0)
    blob = np.exp(-(((down - 45) / 20) ** 2) - ((right - 30) / 12) ** 2)
    return np.exp(-np.maximum(blob * (1 + 3 * structure) - 0.05, 0)).astype(np.float32)


def test_a_pattern_that_gets_into_the_smoke_is_told_from_one_that_is_there_by_chance(cloth: np.ndarray):
    frames = {"own": [], "leaked": []}
    for seed in range(10, 16):
        passed = smoke(seed)
        leaked = passed ** (1 + 2.0 * (cloth[..., 0] - 0.4))
        for name, through in (("own", passed), ("leaked", leaked)):
            shown = through[..., None] * cloth
            figures = front_figures(shown, shown + 0.01, cloth, through, 40.0)
            assert figures is not None and 30 < figures.box < 45
            frames[name].append(figures)
    own, leaked = (pattern_figures(each) for each in frames.values())
    assert abs(own["mean"]) < 3 * own["error"]
    assert leaked["mean"] > own["mean"] + 3 * own["error"]
    # chance averages down over frames that differ
    assert own["error"] < 0.8 * own["chance"]
    assert own["largest"] < 1.5 * own["largest_chance"] < leaked["largest"]


def test_a_frame_without_smoke_has_no_figures(cloth: np.ndarray):
    assert front_figures(cloth, cloth, cloth, np.ones((ROWS, COLUMNS), np.float32), 0.0) is None


def test_a_plain_background_has_no_pattern():
    black = np.zeros((ROWS, COLUMNS, 3), np.float32)
    figures = front_figures(black + 0.1, black + 0.1, black, smoke(0), 40.0)
    assert figures is not None and figures.pattern == 0.0
