"""Copies that were shifted or mirrored."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from smokelift.evaluation.metrics import aligned_detail_correlation, detail_correlation


def smoke(seed: int, shape: tuple[int, int] = (72, 56)) -> np.ndarray:
    """A ball of cloudy smoke before black."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal(shape), 1.2)
    rows, columns = np.indices(shape)
    return np.exp(-(((rows - 36) / 16) ** 2) - ((columns - 28) / 12) ** 2) * (1 + noise)


def test_a_shifted_and_mirrored_copy_is_found() -> None:
    """Where the correlation in place sees next to nothing."""
    front = smoke(1)
    for copy in (front, np.roll(front, (5, -7), (0, 1)), 3 * np.roll(front[:, ::-1], (-4, 6), (0, 1))):
        assert aligned_detail_correlation(copy, front) > 0.97
    assert abs(detail_correlation(np.roll(front, (5, -7), (0, 1)), front)) < 0.3


def test_other_smoke_is_no_copy_and_a_mixture_is_in_between() -> None:
    front, other = smoke(1), smoke(2)
    alike = [aligned_detail_correlation(share * front + (1 - share) * other, front) for share in (0.0, 0.5, 1.0)]
    assert alike[0] < 0.5 < alike[1] < 0.9 < alike[2]


def test_pictures_may_differ_in_shape() -> None:
    assert aligned_detail_correlation(smoke(1)[4:, 3:], smoke(1)) > 0.97


def test_empty_pictures_and_single_pixels_have_no_detail_in_common() -> None:
    """A few pixels of an edge correlate by chance."""
    empty, dot = np.zeros((72, 56)), np.zeros((72, 56))
    dot[30, 30] = 1
    for other in (empty, dot):
        assert aligned_detail_correlation(other, smoke(1)) == 0.0
        assert aligned_detail_correlation(smoke(1), other) == 0.0


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        aligned_detail_correlation(np.full((8, 8), np.nan), np.ones((8, 8)))
    with pytest.raises(ValueError, match="rows, columns"):
        aligned_detail_correlation(np.ones((8, 8, 3)), np.ones((8, 8)))
