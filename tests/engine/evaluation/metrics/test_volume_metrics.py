"""Metrics of densities: known values, limits and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from smokelift.evaluation.metrics import height_mass_error, mass, volume_error


def test_volume_error_and_mass() -> None:
    truth = np.random.default_rng(2).random((4, 5, 6))
    assert volume_error(truth, truth) == 0.0
    assert volume_error(np.zeros_like(truth), truth) == 1.0
    assert volume_error(1.5 * truth, truth) == pytest.approx(0.5)
    assert volume_error(0 * truth, 0 * truth) == 0.0
    assert volume_error(truth, 0 * truth) == math.inf
    mask = truth > 0.5
    assert volume_error(np.where(mask, truth, 9), truth, mask) == 0.0
    assert mass(np.ones((4, 5, 6), np.float32), 0.5) == 15.0


def test_height_mass_error() -> None:
    truth = np.random.default_rng(4).random((4, 5, 6))
    assert height_mass_error(np.roll(truth, 2, 0), truth) == pytest.approx(0.0)
    assert height_mass_error(1.2 * truth, truth) == pytest.approx(0.2)
    one = np.zeros((2, 2, 4))
    one[..., 1] = 1.0
    assert height_mass_error(np.roll(one, 1, 2), one) == 2.0
    assert height_mass_error(0 * one, one) == 1.0
