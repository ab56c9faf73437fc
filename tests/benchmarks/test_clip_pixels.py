"""``python -m benchmarks.pipeline.clip_pixels``: what of a clip's detail a picture has, and the table."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.pipeline.clip_pixels import Row, detail_shares, text
from smokelift.pipeline.clip_fit import BesideClip


def beside(blur: float, brighter: float = 1.0) -> BesideClip:
    """White noise as smoke before grey, and the same as a density that lacks detail shows it."""
    noise = np.random.default_rng(0).normal(0.5, 0.1, (96, 96, 1)).astype(np.float32)
    grey = np.full((96, 96, 3), 0.2, np.float32)
    inside = np.zeros((96, 96), np.bool_)
    inside[16:-16, 16:-16] = True
    soft = ndimage.gaussian_filter(noise, (blur, blur, 0))
    return BesideClip(grey + noise, grey + brighter * soft, grey, inside)


def test_what_is_as_sharp_has_all() -> None:
    """And twice the contrast has four times the energy."""
    assert detail_shares(beside(0.0)) == pytest.approx((1, 1))
    assert detail_shares(beside(0.0, 2.0)) == pytest.approx((4, 4), rel=1e-3)


def test_a_blur_takes_the_finest_first() -> None:
    """Of two pixels: next to nothing of details of one pixel is left."""
    fine, coarse = detail_shares(beside(2.0))
    assert fine < 0.1 < coarse < 0.5


def test_the_table_has_a_row_a_run() -> None:
    """The grid that was given loses nothing that is measured."""
    rows = [("draft", Row((36, 36, 64), 26.5, 41.1, (0.07, 0.18), 0.088, 0.1)),
            ("given", Row((8, 8, 8), 20, 30, (0, 0), None, 0.1))]  # fmt: skip
    lines = text(rows).splitlines()
    assert lines[2] == "| draft | 36x36x64 | 8.8% | 26.5 | 41.1 | 0.07 | 0.18 | 0.1 |"
    assert "| given | 8x8x8 |  | 20.0" in lines[3]
