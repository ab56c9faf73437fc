"""Backgrounds of large pictures, found on small ones."""

from pathlib import Path

import numpy as np
import pytest

from smokelift.extraction.find_background import find_background
from smokelift.extraction.plate import Plate
from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from tests.engine.films import Filmed, codes_apart

COUNT = 16
SIZE = (80, 1280)


def film(behind: np.ndarray, gains: np.ndarray | None = None, column: bool = False, noise: float = 1.0) -> Clip:
    """A bright puff that goes by before a background, perhaps beside a column of smoke that stays; noise in codes."""
    random = np.random.default_rng(1)
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
    codes = np.empty((COUNT, *SIZE, 3), np.uint8)
    for n in range(COUNT):
        away = np.hypot(rows - SIZE[0] / 2, columns - 75 * n)
        alpha = 0.7 * np.clip(1.5 - away / 45, 0, 1) * (1 + 0.2 * np.sin(0.9 * n + rows / 12))
        if column:
            alpha = np.maximum(alpha, np.where(np.abs(columns - 640) < 40, random.uniform(0.3, 0.9), 0))
        light = behind * (1 - alpha[..., None]) + 0.6 * alpha[..., None]
        light = light * (1 if gains is None else gains[n])
        encoded = linear_to_srgb(light) * 255 + np.float32(noise) * random.standard_normal(light.shape, np.float32)
        codes[n] = np.clip(encoded + 0.5, 0, 255)
    return Clip(Path("film"), Filmed(codes))


def wall() -> np.ndarray:
    """Tiles with joints and a grain of single pixels, linear."""
    random = np.random.default_rng(0)
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    tiles = np.kron(random.uniform(0.3, 0.5, (SIZE[0] // 20, -(-SIZE[1] // 20), 3)), np.ones((20, 20, 1)))
    encoded = tiles[:, : SIZE[1]] + random.normal(0, 0.02, (*SIZE, 1))
    encoded[(rows % 20 < 2) | (columns % 20 < 2)] += 0.1
    return srgb_to_linear(np.clip(encoded, 0, 1))


def found(clip: Clip) -> Plate:
    background = find_background(clip, None, None)
    assert background.source == "picture"
    return background.plate


@pytest.mark.parametrize(
    ("steps", "noise"), [(False, 1.0), (True, 1.0), (False, 6.0)], ids=["steady", "steps", "noisy"]
)
def test_a_wall_is_found_to_the_last_pixel(steps, noise) -> None:
    truth = wall()
    gains = np.repeat([1.0, 1.25, 0.8, 1.0], COUNT // 4) if steps else None
    plate = found(film(truth, gains, noise=noise))
    known = plate.confidence > 0.5
    np.testing.assert_allclose(255 * plate.noise.white, noise, rtol=0.15)
    assert plate.image.shape == truth.shape
    assert known.mean() > 0.9
    apart = codes_apart(plate.image, truth)[known]
    assert np.median(apart) < 0.8 * noise
    assert np.percentile(apart, 95) < 3 * noise


def test_what_smoke_never_leaves_keeps_the_detail_that_shows_through() -> None:
    truth = wall()
    plate = found(film(truth, column=True))
    inside = np.s_[:, 615:665]
    assert (plate.confidence[inside] < 0.5).mean() > 0.9
    assert 0.03 < np.sqrt(np.trace(plate.errors)) < 0.2
    apart = codes_apart(plate.image, truth)[inside]
    assert np.mean(apart) < 22
    fine, wanted = (linear_to_srgb(image)[inside].mean(-1) for image in (plate.image, truth))
    grain, true_grain = (each[1:, 1:] - each[:-1, :-1] for each in (fine, wanted))
    assert np.corrcoef(grain.ravel(), true_grain.ravel())[0, 1] > 0.8
    assert 0.6 < grain.std() / true_grain.std() < 1.2
