"""Metrics of pictures: known values, limits and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from smokelift.evaluation.metrics import psnr, ssim


def test_psnr() -> None:
    black = np.zeros((8, 8, 3))
    assert psnr(black, black) == math.inf
    assert psnr(black, black + 0.1) == pytest.approx(20.0)
    assert psnr(black, black + 25.5, peak=255) == pytest.approx(20.0)
    part = black.copy()
    part[:4] = 1.0
    mask = np.zeros((8, 8), bool)
    mask[:4] = True
    assert psnr(black, part, mask) == pytest.approx(0.0)
    assert psnr(black, part, ~mask) == math.inf


def test_ssim_against_its_definition() -> None:
    random = np.random.default_rng(0)
    a, b = random.random((2, 11, 11))
    offsets = np.arange(-5, 6)
    window = np.exp(-(offsets**2) / (2 * 1.5**2))
    weights = np.outer(window, window) / window.sum() ** 2
    mean_a, mean_b = (weights * a).sum(), (weights * b).sum()
    variance_a = (weights * (a - mean_a) ** 2).sum()
    variance_b = (weights * (b - mean_b) ** 2).sum()
    covariance = (weights * (a - mean_a) * (b - mean_b)).sum()
    c1, c2 = 0.01**2, 0.03**2
    expected = (2 * mean_a * mean_b + c1) * (2 * covariance + c2)
    expected /= (mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)
    assert ssim(a, b) == pytest.approx(expected)
    assert ssim(255 * a, 255 * b, peak=255) == pytest.approx(expected)


def test_ssim_limits() -> None:
    picture = np.random.default_rng(1).random((30, 40, 3))
    assert ssim(picture, picture) == pytest.approx(1.0)
    blurred = (picture + np.roll(picture, 1, 0)) / 2
    assert ssim(picture, np.roll(picture, 7, 1)) < ssim(picture, blurred) < 1.0
    with pytest.raises(ValueError, match="at least 11 x 11"):
        ssim(picture[:10], picture[:10])
