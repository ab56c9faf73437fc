"""Noise of a clip, measured on what cannot be smoke, and the gain of a frame against its background."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.footage.noise import (
    BLOCK,
    gain_of,
    median_of_seen,
    noise_about,
    peak_spread,
    sample_gains,
    shows_exposure,
    some_blocks,
    white_noise,
)
from tests.engine.films import HEIGHT, WIDTH, puff, wall


def drifting(frames: int, amount: float) -> np.ndarray:
    """Return smooth billows over all of the picture that drift, in sRGB values."""
    billows = ndimage.gaussian_filter(np.random.default_rng(0).standard_normal((120, 400)), 8)
    billows *= amount / billows.std()
    return np.stack([billows[:, 2 * n : 2 * n + 160] for n in range(frames)])[..., None].repeat(3, -1)


@pytest.mark.parametrize("codes", [0.0, 1.0, 4.0, 25.0])
def test_white_noise_is_told_from_smoke_that_fills_the_picture(codes) -> None:
    random = np.random.default_rng(1)
    fog = drifting(8, 0.15)
    noisy = fog + random.normal(0, codes / 255, fog.shape)
    found = white_noise(np.stack([some_blocks(picture) for picture in noisy]))
    np.testing.assert_allclose(255 * found, codes, rtol=0.05, atol=0.5)


@pytest.mark.parametrize("codes", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("smoke", [0.0, 0.4])
def test_the_spread_of_what_is_clear_is_told_from_smoke(codes, smoke) -> None:
    random = np.random.default_rng(2)
    deviations = random.normal(0, codes / 255, 40000)
    covered = random.uniform(size=deviations.size) < smoke
    deviations[covered] = random.uniform(0, 0.6, covered.sum())
    assert 255 * peak_spread(deviations) == pytest.approx(codes, rel=0.3)


def test_what_neighbors_share_lasts(codes=3.0) -> None:
    random = np.random.default_rng(3)
    blocks = random.normal(0, codes / 255, (12, 20, 30, 3))
    pixels = blocks.repeat(BLOCK, 1).repeat(BLOCK, 2) + random.normal(0, 2 / 255, (12, 20 * BLOCK, 30 * BLOCK, 3))
    found = noise_about(np.stack([some_blocks(picture) for picture in pixels]), blocks)
    np.testing.assert_allclose(255 * found.lasting, codes, rtol=0.1)
    np.testing.assert_allclose(255 * found.white, 2, rtol=0.1)


@pytest.mark.parametrize("shape", [(1, 3), (2, 70), (5, 4, 3), (16, 9, 11, 3), (31, 64), (40, 1)])
@pytest.mark.parametrize("hidden", [0.0, 0.6])
@pytest.mark.filterwarnings("ignore:All-NaN slice")
def test_medians_are_those_of_numpy_over_what_is_seen(shape, hidden) -> None:
    """Of one frame, and where values come more than once."""
    random = np.random.default_rng(0)
    for values in (random.standard_normal(shape).astype(np.float32), random.integers(0, 3, shape).astype(np.float32)):
        values[random.random(shape) < hidden] = np.nan
        np.testing.assert_array_equal(median_of_seen(values), np.nanmedian(values, axis=0))


GAINS = np.array([1.3, 1.0, 0.8], np.float32)


def test_a_gain_is_found_beside_smoke_which_is_none() -> None:
    behind = wall(0.3, 0.7).astype(np.float32)
    alpha = puff(12)[..., None]
    seen = (behind * (1 - alpha) + 0.4 * alpha) * GAINS
    np.testing.assert_allclose(gain_of(seen.astype(np.float32), behind), GAINS, rtol=0.01)
    black = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    assert (gain_of(black + 0.3, black) == 1).all()
    rows = np.arange(HEIGHT)[:, None, None]
    assert (gain_of(np.where(rows < 0.85 * HEIGHT, 0.5 * behind + 0.2, behind), behind) == 1).all()


def test_a_flash_has_its_own_gain() -> None:
    frames = np.repeat(wall(0.2, 0.4).astype(np.float32)[None], 9, 0)
    frames[4] *= 3
    gains = sample_gains(frames)
    np.testing.assert_allclose(gains[4], 3, rtol=0.01)
    assert (np.delete(gains, 4, 0) == 1).all()


@pytest.mark.parametrize(("value", "shown"), [(0.0, False), (0.002, False), (0.2, True), (1.0, False)])
def test_black_and_white_show_no_exposure(value, shown) -> None:
    background = np.full((40, 60, 3), value, np.float32)
    assert shows_exposure(background) is shown
    background[:6, :6] = 0.3
    assert shows_exposure(background)
