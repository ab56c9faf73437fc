"""Metrics of pictures' detail: known values, limits and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.evaluation.metrics import detail_correlation, octave_power, row_constant_detail, spectrum_distance


def test_octaves_and_their_distance() -> None:
    rows, columns = np.indices((96, 64))
    fine, coarse = np.sin(2 * np.pi * 24 * rows / 96), np.sin(2 * np.pi * 3 * columns / 96)
    assert octave_power(fine).argmax() == 3
    assert octave_power(coarse).argmax() == 0
    truth = octave_power(fine + coarse)
    distance, octaves = spectrum_distance(octave_power(fine + 0.1 * coarse), truth)
    assert octaves[0] == pytest.approx(-20, abs=0.5)
    assert octaves[3] == pytest.approx(0, abs=0.1)
    assert distance == pytest.approx(np.sqrt(np.mean(octaves**2)))
    assert spectrum_distance(truth, truth)[0] == 0.0
    with pytest.raises(ValueError, match="nothing"):
        spectrum_distance(truth, 0 * truth)
    with pytest.raises(ValueError, match="rows, columns"):
        octave_power(np.zeros((8, 8, 3)))


def test_row_constant_detail() -> None:
    """Detail of rows counts wholly, of columns and of noise next to none."""
    rows, columns = np.indices((96, 64))
    assert row_constant_detail(2 + np.sin(rows)) == pytest.approx(1, abs=0.01)
    assert row_constant_detail(2 + np.sin(columns)) < 0.01
    assert row_constant_detail(2 + np.random.default_rng(4).random((96, 64))) < 0.05
    assert row_constant_detail(np.zeros((8, 8))) == 0


def test_detail_correlation() -> None:
    """Detail counts, not the outline, nor how strong or bright it is."""
    one, other = np.random.default_rng(5).random((2, 96, 64))
    assert detail_correlation(3 * one + 1, one) > 0.99
    assert abs(detail_correlation(one, other)) < 0.05
    outline = np.hypot(*np.indices((96, 64)) - 32) < 20
    assert abs(detail_correlation(outline * (5 + one), outline * (5 + other))) < 0.95
    assert detail_correlation(np.zeros((8, 8)), np.zeros((8, 8))) == 0
