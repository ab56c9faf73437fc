"""Patches: their kernels against plain NumPy, and pictures that take over a distribution."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from smokelift import _core
from smokelift.density.exemplar import SIZE, Exemplar, enlarged, reduced


def smoke(seed: int, fineness: float, shape: tuple[int, int] = (48, 64)) -> np.ndarray:
    """Optical depth of a blob with detail of a size in pixels."""
    random = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(random.normal(size=shape), fineness)
    x, z = (
        np.arange(n)[:, None].T + 0.5 - n / 2 if k else np.arange(n)[:, None] + 0.5 - n / 2 for k, n in enumerate(shape)
    )
    blob = np.exp(-((np.hypot(x / 14, z / 22)) ** 4))
    return np.asarray(blob * np.clip(1 + noise / noise.std(), 0, None), np.float32)


def fine(picture: np.ndarray) -> float:
    """How strong its detail is."""
    return float(np.linalg.norm(picture - ndimage.gaussian_filter(picture, 1.5)) / np.linalg.norm(picture))


def test_unfolding_and_folding_are_plain_slices_and_means() -> None:
    random = np.random.default_rng(0)
    picture = random.random((12, 15), np.float32)
    at = np.array([[1, 1, 6, 10], [1, 2, 9, 13]], np.int32)
    pixels = _core.unfold(picture, at, 3)
    expected = [picture[r - 1 : r + 2, c - 1 : c + 2].ravel() for r, c in at.T]
    np.testing.assert_array_equal(pixels.T, expected)
    values = random.random(pixels.shape, np.float32)
    total, count = np.zeros((12, 15)), np.zeros((12, 15))
    for n, (r, c) in enumerate(at.T):
        total[r - 1 : r + 2, c - 1 : c + 2] += values[:, n].reshape(3, 3)
        count[r - 1 : r + 2, c - 1 : c + 2] += 1
    np.testing.assert_allclose(_core.fold(values, at, 3, (12, 15)), total / np.maximum(count, 1), rtol=1e-6)


@given(st.integers(1, 300), st.integers(1, 40), st.integers(0, 2**32 - 1))
def test_moved_values_have_the_wanted_distribution(count, known, seed) -> None:
    """Sorted, they are the wanted quantiles, whose order is kept; equal values keep the order of their places."""
    random = np.random.default_rng(seed)
    values = np.round(random.normal(size=(2, count)), 1).astype(np.float32) + np.float32(0)
    wanted = np.sort(random.normal(size=(2, known))).astype(np.float32)
    moves = values.copy()
    _core.to_quantiles(moves, wanted)
    for before, move, quantiles in zip(values, moves, wanted, strict=True):
        at = np.clip((np.arange(count) + 0.5) / count * known - 0.5, 0, known - 1)
        expected = np.interp(at, np.arange(known), quantiles)
        order = np.argsort(before, kind="stable")
        np.testing.assert_allclose((before + move)[order], expected, atol=1e-5)


def test_reducing_keeps_means_and_enlarging_keeps_lines() -> None:
    picture = np.random.default_rng(2).random((13, 10), np.float32)
    assert reduced(picture, 4).sum() * 16 == pytest.approx(picture.sum(), rel=1e-5)
    line = np.broadcast_to(np.arange(16, dtype=np.float32)[:, None], (16, 8)).copy()
    np.testing.assert_allclose(enlarged(reduced(line, 4), 4, line.shape)[2:14], line[2:14], atol=1e-5)


@pytest.mark.parametrize("scale", [1, 2])
def test_a_smooth_picture_takes_over_the_detail_of_an_exemplar(scale) -> None:
    exemplar = Exemplar.of([smoke(seed, 1.5 * scale) for seed in range(4)], scale)
    smooth = reduced(smoke(9, 12.0), scale)
    like = reduced(smoke(8, 1.5 * scale), scale)
    found = smooth
    for turn in range(4):
        found = exemplar.towards(found, turn)
    assert fine(found) > 0.6 * fine(like)
    assert fine(smooth) < 0.4 * fine(like)
    kept = exemplar.towards(like, 0)
    assert np.linalg.norm(kept - like) < 0.5 * np.linalg.norm(like - ndimage.gaussian_filter(like, SIZE / 2))


@pytest.mark.parametrize("line", [np.s_[0, 3:9], np.s_[-1, :], np.s_[:, 0], np.s_[7, 7]])
def test_smoke_along_an_edge_has_patches(line) -> None:
    """Shifted pictures of it are empty."""
    picture = np.zeros((32, 24), np.float32)
    picture[line] = 0.5
    for scale in (1, 2, 4):
        found = Exemplar.of([picture], scale)
        assert np.isfinite(found.quantiles).all()
        assert np.isfinite(found.towards(reduced(picture, scale), 0)).all()
