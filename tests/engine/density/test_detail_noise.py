from types import SimpleNamespace

import numpy as np
import pytest

import smokelift._core as _core
from smokelift.density.detail_noise import stretched_noise
from smokelift.density.texture import roughness

WIDTH = 8.0
NONE = (0.0, 0.0, 0.0)


def level(shape) -> SimpleNamespace:
    """A grid that may hold smoke everywhere."""
    where = _core.MarkedVoxels(np.ones(shape, np.bool_))
    return SimpleNamespace(views=SimpleNamespace(where=where), coarseness=1, coarser=None)


def body(shape) -> np.ndarray:
    """Smooth smoke along the last axis, of a Gaussian profile as wide as `WIDTH`."""
    x, y = ((np.arange(count) - (count - 1) / 2) / WIDTH for count in shape[:2])
    return np.exp(-(x[:, None, None] ** 2 + y[:, None] ** 2) / 2) * np.ones(shape)


def picture(strengths, seed) -> np.ndarray:
    """Optical depth of that smoke with noise."""
    shape = (48, 48, 64)
    noise = stretched_noise(level(shape), np.zeros(3), WIDTH, strengths, seed).reshape(shape)
    return (body(shape) * np.exp(noise)).sum(1).astype(np.float32)


@pytest.mark.parametrize("strength", [0.5, 1.0])
def test_roughness_is_the_strength_of_noise(strength) -> None:
    found = roughness([picture((strength,) * 3, seed) for seed in range(6)], WIDTH)
    assert found == pytest.approx((strength,) * 3, rel=0.3)


@pytest.mark.parametrize("octave", [1, 2])
def test_roughness_is_found_on_its_scale(octave) -> None:
    with_it, without = (
        roughness([picture(tuple(0.8 * (each == number) for each in range(3)), 0)], WIDTH) for number in (octave, -1)
    )
    gains = np.array(with_it) / np.array(without)
    assert gains[octave] > 1.8
    assert gains[0] < 1.3


def test_laminar_smoke_is_smooth() -> None:
    coarse, middle, fine = roughness([picture(NONE, 0)], WIDTH)
    assert fine < 0.1
    assert middle < 0.25
    assert coarse < 0.6


def test_noise_has_its_strengths() -> None:
    noise = stretched_noise(level((64, 64, 64)), np.zeros(3), 4.0, (0.3, 0.4), 0)
    assert noise.std() == pytest.approx(0.5, rel=0.1)
    assert noise.mean() == pytest.approx(0, abs=0.05)
    assert not stretched_noise(level((8, 8, 8)), np.zeros(3), WIDTH, NONE, 0).any()


def test_noise_moves_with_the_smoke() -> None:
    shape = (12, 12, 24)
    before, after = (
        stretched_noise(level(shape), np.array([0.0, 0.0, by]), WIDTH, (0.5, 0.5, 0.5), 3).reshape(shape)
        for by in (0.0, 4.0)
    )
    np.testing.assert_allclose(after[..., 4:], before[..., :-4], atol=1e-4)


def test_fine_octaves_are_drawn_out() -> None:
    """They vary more along one direction than along another, voxel by voxel, than one octave alone as fine as they."""
    shape = (48, 48, 48)

    def drawn_out(width: float, strengths: tuple[float, ...]) -> float:
        noise = stretched_noise(level(shape), np.zeros(3), width, strengths, 0)
        slopes = np.stack(np.gradient(noise.reshape(shape)))
        tensor = np.einsum("i...,j...->...ij", slopes, slopes).reshape(6, 8, 6, 8, 6, 8, 3, 3).mean((1, 3, 5))
        least, _, most = np.moveaxis(np.linalg.eigvalsh(tensor), -1, 0)
        return float(np.median(most / least))

    assert drawn_out(WIDTH, (0.0, 0.0, 1.0)) > 1.5 * drawn_out(WIDTH / 4, (1.0,))
