"""The clean plate that is found from the clip alone, also that of large pictures, found on small ones."""

from pathlib import Path

import numpy as np
import pytest

from smokelift.extraction.clean_plate import _correction, clean_plate
from smokelift.extraction.find_background import find_background
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate
from smokelift.extraction.proxy import Proxy
from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import lasting_noise
from smokelift.setup.first_estimate import first_estimate
from tests.engine.films import HEIGHT, WIDTH, Filmed, codes_apart, film, plate_of, puff, wall


@pytest.mark.parametrize(
    ("low", "high", "color"),
    [(0.2, 0.5, 0.6), (0.6, 0.9, 0.02), (0.2, 0.9, 0.25)],
    ids=["brightening", "darkening", "both"],
)
def test_plate_and_matte(tmp_path, low, high, color) -> None:
    truth = wall(low, high)
    clip = film(tmp_path, truth, puff, color)
    plate = plate_of(clip)
    assert plate.image.shape == truth.shape
    assert plate.confidence.shape == truth.shape[:2]
    assert plate.confidence.mean() > 0.85
    assert np.percentile(codes_apart(plate.image, truth)[plate.confidence == 1], 95) < 5.0
    # what smoke of the wall's own brightness leaves unknown is found in turn with it
    plate = first_estimate(clip, None, None).plate
    apart = codes_apart(plate.image, truth)
    assert np.median(apart) < 0.7
    assert np.percentile(apart, 95) < 5.0
    for n in (4, 12, 20):
        result = matte(clip.frame(n), plate)
        contrast = puff(n) * np.abs(linear_to_srgb(truth) - linear_to_srgb(color)).mean(axis=2) * 255
        assert result.deviation.dtype == np.float32
        assert result.mask[contrast > 12].mean() > 0.95
        assert result.mask[puff(n) == 0.0].mean() < 0.08
        assert np.median(result.deviation[puff(n) == 0.0]) < 1.5


def test_noise_is_measured(tmp_path) -> None:
    for name, codes in (("quiet", 0.0), ("noisy", 4.0)):
        flat = np.full((HEIGHT, WIDTH, 3), 0.2, np.float32)
        plate = plate_of(film(tmp_path / name, flat, puff, 0.8, codes))
        assert plate.noise.total.shape == (3,)
        np.testing.assert_allclose(plate.noise.total, max(codes, 1.0) / 255, rtol=0.25)
        np.testing.assert_allclose(plate.noise.lasting, 1 / 255, rtol=0.3)


def test_pixels_that_are_never_clear_are_filled_and_marked(tmp_path) -> None:
    truth = np.linspace(0.1, 0.3, WIDTH, dtype=np.float32)[None, :, None].repeat(HEIGHT, 0).repeat(3, 2)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    jet = (np.abs(columns - WIDTH / 2) < 5) & (rows > 30)

    def opacity(n: int) -> np.ndarray:
        flicker = np.random.default_rng(n).uniform(0.3, 0.9)
        return np.where(jet, flicker, 0.0)

    clip = film(tmp_path, truth, opacity, 0.9, 0.5)
    plate = plate_of(clip)
    inner = (np.abs(columns - WIDTH / 2) < 3) & (rows > 34)
    assert plate.confidence[inner].max() < 0.5
    assert plate.confidence[np.abs(columns - WIDTH / 2) > 8].min() == 1.0
    assert 0 < np.sqrt(np.trace(plate.errors)) < 0.05
    assert codes_apart(plate.image, truth)[inner].max() < 20
    assert all(matte(clip.frame(n), plate).mask[inner].all() for n in (0, 11, 23))


@pytest.mark.parametrize(("color", "edge"), [(0.9, 0.1), (0.02, 0.9)])
def test_smoke_that_never_leaves_tells_itself_which_way_it_changes_the_picture(tmp_path, color, edge) -> None:
    truth = np.linspace(0.2, 0.3, WIDTH, dtype=np.float32)[None, :, None].repeat(HEIGHT, 0).repeat(3, 2)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    column = np.abs(columns - WIDTH / 2) < 14
    shred = (np.abs(rows - 28) < 2) & (np.abs(columns - 48) < 2)

    def opacity(n: int) -> np.ndarray:
        thickness = np.random.default_rng(n).uniform(0.3, 0.9, (HEIGHT, 1))
        return np.where(column, thickness, 0.5 * (shred & (n == 5)))

    shown = np.where(column, color, edge)[..., None].astype(np.float32)
    plate = plate_of(film(tmp_path, truth, opacity, shown, 0.5))
    inner = np.abs(columns - WIDTH / 2) < 6
    assert plate.confidence[inner].max() < 0.5
    assert np.median(codes_apart(plate.image, truth)[inner]) < 15


PLUME = np.exp(-(((np.arange(WIDTH) - WIDTH / 2) / 8) ** 2)) * np.ones((HEIGHT, 1))
"""Opacity of a column that never leaves the middle."""


@pytest.mark.parametrize(("hue", "thickest", "even"), [((0.4, 0.3, 0.2), 0.6, False), ((0.45, 0.3, 0.18), 0.9, True)])
def test_a_plume_that_never_leaves_a_smooth_wall_shows_by_its_hue(tmp_path, hue, thickest, even) -> None:
    """It hardly changes and is hardly brighter than the wall, or changes the mean of the channels by nothing."""
    tone = np.linspace(0.8, 1.2, HEIGHT, dtype=np.float32)[:, None, None]
    truth = np.repeat(tone * np.float32(hue), WIDTH, 1)
    color = srgb_to_linear(linear_to_srgb(truth).mean(-1, keepdims=True)) if even else 0.42

    def opacity(n: int) -> np.ndarray:
        return PLUME * np.random.default_rng(n).uniform(0.3, thickest, (HEIGHT // 8, 1)).repeat(8, 0)

    plate = plate_of(film(tmp_path, truth, opacity, color, 0.5))
    assert plate.confidence[PLUME > 0.7].mean() < 0.3
    assert plate.confidence[PLUME < 0.01].min() == 1.0


def test_a_wall_that_is_hardly_shaded_tells_its_smoke_by_hue(tmp_path) -> None:
    """Its pixels differ by fewer codes than an even color's may."""
    tone = np.linspace(0.88, 1.12, WIDTH, dtype=np.float32)[:, None]
    truth = np.broadcast_to(tone * np.float32((0.18, 0.32, 0.16)), (HEIGHT, WIDTH, 3))
    estimate = first_estimate(film(tmp_path, truth, puff, 0.4, 0.5), None, None)
    assert estimate.found.kind == "picture"
    assert estimate.source == pytest.approx(np.full(3, 0.4), rel=0.25)


def test_slow_fog_that_never_leaves_is_no_noise_of_its_background(tmp_path) -> None:
    """It changes by a code or two from frame to frame, and by forty in all."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    waves = rows / 14 + columns / 25

    def opacity(n: int) -> np.ndarray:
        return 0.45 + 0.2 * np.sin(2 * np.pi * n / 40 + waves)

    plate = plate_of(film(tmp_path, wall(0.2, 0.5), opacity, 0.02, 0.5))
    assert plate.confidence.mean() < 0.3


def test_the_last_smoke_is_no_part_of_a_smooth_wall(tmp_path) -> None:
    """Half of the frames show its haze alone, as steady as the wall."""
    tone = np.linspace(0.15, 0.4, HEIGHT, dtype=np.float32)[:, None, None]
    truth = np.broadcast_to(tone, (HEIGHT, WIDTH, 3))
    plate = plate_of(film(tmp_path, truth, lambda n: PLUME * (0.04 if n % 2 else 0.6), 0.8, 0.5))
    assert codes_apart(plate.image, truth)[PLUME > 0.7].mean() < 5


def test_haze_that_stands_beside_smoke_is_no_part_of_a_smooth_wall(tmp_path) -> None:
    """It never changes, and is up to three codes brighter than the wall, which goes on beside it."""
    away = np.abs(np.mgrid[:HEIGHT, :WIDTH][1] - WIDTH / 2)
    haze = 0.02 * np.exp(-0.5 * ((away - 5) / 3) ** 2)
    flat = np.full((HEIGHT, WIDTH, 3), 0.2, np.float32)
    clip = film(tmp_path, flat, lambda n: np.where(away < 5, np.random.default_rng(n).uniform(0.3, 0.9), haze), 0.8)
    found = clean_plate(Proxy.of(clip), lasting_noise(1 / 255))
    beside = (away > 5) & (away < 10)
    assert found.known[beside].all()
    assert codes_apart(found.image, flat)[beside].mean() < 1


def test_what_hardly_changes_is_background_however_unlike_its_surroundings(tmp_path) -> None:
    jacket = np.s_[40:, :12]
    truth = wall(0.6, 0.9)
    truth[jacket] = 0.01

    def opacity(n: int) -> np.ndarray:
        seen = puff(n)
        seen[jacket] = np.random.default_rng(n).uniform(0.0, 0.03)
        return seen

    clip = film(tmp_path, truth, opacity, 0.25, 0.5)
    plate = plate_of(clip)
    inner = np.s_[44:, :9]
    assert plate.confidence[inner].min() == 1.0
    assert codes_apart(plate.image, truth)[inner].max() < 12
    assert not matte(clip.frame(12), plate).mask[inner].any()


def test_a_clear_moment_is_corrected_by_what_goes_on_beside_it_but_an_object_is_not() -> None:
    image = np.broadcast_to(np.linspace(0.2, 0.4, 64, dtype=np.float32)[:, None, None], (64, 64, 3)).copy()
    truth, steady = image.copy(), np.ones((64, 64), np.bool_)
    steady[20:44, 24:40] = False
    image[20:32, 24:40] *= 1.03
    image[32:44, 24:40] *= 2.0
    weights, smoke = np.full(3, 1 / 3, np.float32), np.full((64, 64), 0.03, np.float32)
    change = _correction(image, np.ones_like(steady), steady, weights, smoke)
    assert np.abs((image + change - truth)[22:30, 24:40]).mean() < 0.4 * np.abs((image - truth)[22:30, 24:40]).mean()
    assert max(np.abs(change[34:44, 24:40]).max(), np.abs(change[steady]).max()) < 1e-6


FRAMES = 16
LARGE = (80, 1280)


def whole_film(behind: np.ndarray, gains: np.ndarray | None = None, column: bool = False, noise: float = 1.0) -> Clip:
    """A bright puff that goes by before a background, perhaps beside a column of smoke that stays; noise in codes."""
    random = np.random.default_rng(1)
    rows, columns = np.mgrid[: LARGE[0], : LARGE[1]].astype(np.float32)
    codes = np.empty((FRAMES, *LARGE, 3), np.uint8)
    for n in range(FRAMES):
        away = np.hypot(rows - LARGE[0] / 2, columns - 75 * n)
        alpha = 0.7 * np.clip(1.5 - away / 45, 0, 1) * (1 + 0.2 * np.sin(0.9 * n + rows / 12))
        if column:
            alpha = np.maximum(alpha, np.where(np.abs(columns - 640) < 40, random.uniform(0.3, 0.9), 0))
        light = behind * (1 - alpha[..., None]) + 0.6 * alpha[..., None]
        light = light * (1 if gains is None else gains[n])
        encoded = linear_to_srgb(light) * 255 + np.float32(noise) * random.standard_normal(light.shape, np.float32)
        codes[n] = np.clip(encoded + 0.5, 0, 255)
    return Clip(Path("film"), Filmed(codes))


def large_wall() -> np.ndarray:
    """Tiles with joints and a grain of single pixels, linear."""
    random = np.random.default_rng(0)
    rows, columns = np.mgrid[: LARGE[0], : LARGE[1]]
    tiles = np.kron(random.uniform(0.3, 0.5, (LARGE[0] // 20, -(-LARGE[1] // 20), 3)), np.ones((20, 20, 1)))
    encoded = tiles[:, : LARGE[1]] + random.normal(0, 0.02, (*LARGE, 1))
    encoded[(rows % 20 < 2) | (columns % 20 < 2)] += 0.1
    return srgb_to_linear(np.clip(encoded, 0, 1))


def found_on(clip: Clip) -> Plate:
    background = find_background(clip, None, None)
    assert background.kind == "picture"
    return background.plate


@pytest.mark.parametrize(
    ("steps", "noise"), [(False, 1.0), (True, 1.0), (False, 6.0)], ids=["steady", "steps", "noisy"]
)
def test_a_wall_is_found_to_the_last_pixel(steps, noise) -> None:
    truth = large_wall()
    gains = np.repeat([1.0, 1.25, 0.8, 1.0], FRAMES // 4) if steps else None
    plate = found_on(whole_film(truth, gains, noise=noise))
    known = plate.confidence > 0.5
    np.testing.assert_allclose(255 * plate.noise.white, noise, rtol=0.15)
    assert plate.image.shape == truth.shape
    assert known.mean() > 0.9
    apart = codes_apart(plate.image, truth)[known]
    assert np.median(apart) < 0.8 * noise
    assert np.percentile(apart, 95) < 3 * noise


def test_what_smoke_never_leaves_keeps_the_detail_that_shows_through() -> None:
    truth = large_wall()
    plate = found_on(whole_film(truth, column=True))
    inside = np.s_[:, 615:665]
    assert (plate.confidence[inside] < 0.5).mean() > 0.9
    assert 0.03 < np.sqrt(np.trace(plate.errors)) < 0.2
    apart = codes_apart(plate.image, truth)[inside]
    assert np.mean(apart) < 22
    fine, wanted = (linear_to_srgb(image)[inside].mean(-1) for image in (plate.image, truth))
    grain, true_grain = (each[1:, 1:] - each[:-1, :-1] for each in (fine, wanted))
    assert np.corrcoef(grain.ravel(), true_grain.ravel())[0, 1] > 0.8
    assert 0.6 < grain.std() / true_grain.std() < 1.2
