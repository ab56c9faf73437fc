"""Distributions of patches: the same texture elsewhere is near, blur, rows and noise are far."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.evaluation.metrics import PatchStatistics, mean_gradient


def smoke(seed: int, shape: tuple[int, int] = (72, 60)) -> np.ndarray:
    """Round smoke with a texture of its own."""
    texture = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal(shape), 1.5)
    rows, columns = np.indices(shape) - np.array([36, 30])[:, None, None]
    return np.maximum(1 + 3 * texture, 0) * np.maximum(1 - (rows / 30) ** 2 - (columns / 24) ** 2, 0)


def distances(picture: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Of the patches, and of their texture."""
    found, true = PatchStatistics.of(picture), PatchStatistics.of(reference)
    return np.array([found.distance(true), found.texture_distance(true)])


def test_the_same_texture_is_near_and_any_other_is_farther():
    picture, other = smoke(1), smoke(2)
    alike = distances(other, picture)
    assert distances(picture, picture).tolist() == [0, 0]
    assert (alike > 0).all()
    noisy = picture + 0.3 * picture.max() * np.random.default_rng(3).random(picture.shape) * (picture > 0)
    for fake in (ndimage.gaussian_filter(other, 3), noisy, 0.5 * other):
        assert (distances(fake, picture) > 1.5 * alike).all()


def test_the_texture_sees_a_comb_that_the_patches_do_not():
    picture, other = smoke(1), smoke(2)
    comb = 1 + 0.2 * np.sin(2.5 * np.arange(len(other)))[:, None]
    patches, texture = distances(other * comb, picture) / distances(other, picture)
    assert patches < 1.1 < 2 < texture


def test_where_smoke_is_does_not_count_nor_how_much_black_is_around():
    picture, other = (np.pad(smoke(seed), 16) for seed in (1, 2))
    assert distances(np.pad(picture, ((40, 8), (4, 20))), picture) == pytest.approx(0)
    elsewhere = np.pad(picture, ((2, 0), (0, 3)))  # other squares are averaged
    assert (distances(elsewhere, picture) < 0.3 * distances(other, picture)).all()
    assert distances(2 * picture, 2 * other) == pytest.approx(distances(picture, other))


def test_no_smoke_at_all_has_a_distance_of_about_one():
    black = np.zeros((20, 30))
    assert distances(black, smoke(1)) == pytest.approx(1, abs=0.1)
    assert distances(black, black).tolist() == [0, 0]
    assert distances(smoke(1), black).tolist() == [np.inf, np.inf]


def test_a_gradient_is_measured_in_the_picture_s_own_brightness():
    ramp = np.outer(np.ones(5), np.arange(1.0, 6))
    assert mean_gradient(ramp) == mean_gradient(7 * ramp) == pytest.approx(1 / 3)
    assert mean_gradient(np.zeros((4, 4))) == 0
