"""The clean plate that is found from the clip alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from films import HEIGHT, WIDTH, codes_apart, film, plate_of, puff, wall

from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb
from smokelift.footage.matte import matte
from smokelift.output.images import write_image

DATA = Path(__file__).parents[4] / "shared" / "data"


@pytest.mark.parametrize(
    ("low", "high", "colour"),
    [(0.2, 0.5, 0.6), (0.6, 0.9, 0.02), (0.2, 0.9, 0.25)],
    ids=["brightening", "darkening", "both"],
)
def test_plate_and_matte(tmp_path: Path, low: float, high: float, colour: float) -> None:
    truth = wall(low, high)
    clip = film(tmp_path, truth, puff, colour)
    plate = plate_of(clip)
    assert plate.image.shape == truth.shape
    assert plate.confidence.shape == truth.shape[:2]
    assert plate.confidence.mean() > 0.85
    apart = codes_apart(plate.image, truth)
    assert np.median(apart) < 0.7
    assert np.percentile(apart, 95) < 5.0
    for n in (4, 12, 20):
        result = matte(clip.frame(n), plate)
        contrast = puff(n) * np.abs(linear_to_srgb(truth) - linear_to_srgb(colour)).mean(axis=2) * 255
        assert result.deviation.dtype == np.float32
        assert result.mask[contrast > 12].mean() > 0.95
        assert result.mask[puff(n) == 0.0].mean() < 0.08
        assert np.median(result.deviation[puff(n) == 0.0]) < 1.5


def test_noise_is_measured(tmp_path: Path) -> None:
    for name, codes in (("quiet", 0.0), ("noisy", 4.0)):
        (tmp_path / name).mkdir()
        flat = np.full((HEIGHT, WIDTH, 3), 0.2, np.float32)
        plate = plate_of(film(tmp_path / name, flat, puff, 0.8, codes))
        assert plate.noise.total.shape == (3,)
        np.testing.assert_allclose(plate.noise.total, max(codes, 1.0) / 255, rtol=0.25)
        np.testing.assert_allclose(plate.noise.lasting, 1 / 255, rtol=0.3)


def test_smoke_is_found_in_much_noise_before_a_wall_that_is_not_told(tmp_path: Path) -> None:
    """What differs from pixel to pixel is no lasting noise of blocks, which would hide the smoke from the matte."""
    clip = film(tmp_path, wall(0.2, 0.5), puff, 0.6, 13.0)
    plate = plate_of(clip)
    assert plate.noise.lasting.max() * 255 < 1.5
    for n in (8, 20):
        mask = matte(clip.frame(n), plate).mask
        assert mask[puff(n) > 0.3].mean() > 0.9
        assert mask[puff(n) == 0.0].mean() < 0.08


def test_a_burst_that_comes_over_all_of_black_is_no_noise(tmp_path: Path) -> None:
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]

    def burst(n: int) -> np.ndarray:
        return (6 <= n < 15) * (0.6 + 0.3 * np.sin(rows / 7 + n) * np.cos(columns / 9 - n))

    clip = film(tmp_path, np.zeros((HEIGHT, WIDTH, 3), np.float32), burst, 0.9)
    plate = plate_of(clip)
    assert plate.image.max() < 0.01
    assert plate.noise.total.max() < 3 / 255
    assert matte(clip.frame(10), plate).mask.mean() > 0.95
    assert matte(clip.frame(2), plate).mask.mean() < 0.02


def test_pixels_that_are_never_clear_are_filled_and_marked(tmp_path: Path) -> None:
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


def test_haze_that_looks_like_its_surroundings_is_not_continued_behind_the_smoke(tmp_path: Path) -> None:
    """Thin smoke around a jet that never goes away, and changes by some codes only."""
    truth = np.full((HEIGHT, WIDTH, 3), 0.2, np.float32)
    beside = np.abs(np.mgrid[:HEIGHT, :WIDTH][1] - WIDTH / 2)

    def opacity(n: int) -> np.ndarray:
        random = np.random.default_rng(n)
        thick, thin = random.uniform(0.3, 0.9), random.uniform(0.06, 0.1)
        return np.where(beside < 5, thick, np.where(beside < 15, thin, 0.0))

    plate = plate_of(film(tmp_path, truth, opacity, 0.9, 0.5))
    behind = beside < 3
    assert plate.confidence[behind].max() < 0.5
    assert np.median(codes_apart(plate.image, truth)[behind]) < 16


def test_what_hardly_changes_amid_smoke_is_not_background_for_looking_like_it(tmp_path: Path) -> None:
    """Thin smoke that hardly changes, amid a jet that never goes away and beside it."""
    truth = np.linspace(0.15, 0.25, WIDTH, dtype=np.float32)[None, :, None].repeat(HEIGHT, 0).repeat(3, 2)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    jet = np.abs(columns - 20) < 16
    amid, aside = (np.hypot(rows - 36, columns - middle) < 8 for middle in (20, 43))

    def opacity(n: int) -> np.ndarray:
        random = np.random.default_rng(n)
        thick, thin = random.uniform(0.3, 0.9), random.uniform(0.06, 0.1)
        return np.where(amid | aside, thin, np.where(jet, thick, 0.0))

    plate = plate_of(film(tmp_path, truth, opacity, 0.9, 0.5))
    assert plate.confidence[amid].max() < 0.5
    assert plate.confidence[np.hypot(rows - 36, columns - 43) < 5].min() == 1.0


def test_what_a_codec_changes_is_no_sign_of_dark_smoke(tmp_path: Path) -> None:
    """Bright smoke passes, or never goes away; beside it some frames are some codes too dark."""
    truth = wall(0.45, 0.5)
    truth[:24] = wall(0.2, 0.25)[:24]
    columns = np.arange(WIDTH)
    smoky = np.zeros((HEIGHT, WIDTH), np.bool_)
    smoky[8:64, 12:44] = True

    def opacity(n: int) -> np.ndarray:
        cloud = np.random.default_rng(n).uniform(0.2, 0.9, (HEIGHT, 1)).repeat(WIDTH, 1)
        cloud[8:24] = 0.2 * (n % 12 == 1)
        return np.where(smoky, cloud, np.where(columns < 12, 0.15 * (n % 12 == 3), 0.15 * (n % 12 == 7)))

    plate = plate_of(film(tmp_path, truth, opacity, np.where(smoky, 0.9, 0.0)[..., None], 0.5))
    stays = np.s_[34:56, 20:36]
    assert plate.confidence[stays].max() < 0.5
    assert np.median(codes_apart(plate.image, truth)[stays]) < 15


@pytest.mark.parametrize(("colour", "edge"), [(0.9, 0.1), (0.02, 0.9)])
def test_smoke_that_never_leaves_tells_itself_which_way_it_changes_the_picture(
    tmp_path: Path, colour: float, edge: float
) -> None:
    """A chimney's column, beside which a shred of the other brightness passes once."""
    truth = np.linspace(0.2, 0.3, WIDTH, dtype=np.float32)[None, :, None].repeat(HEIGHT, 0).repeat(3, 2)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    column = np.abs(columns - WIDTH / 2) < 14
    shred = (np.abs(rows - 28) < 2) & (np.abs(columns - 48) < 2)

    def opacity(n: int) -> np.ndarray:
        thickness = np.random.default_rng(n).uniform(0.3, 0.9, (HEIGHT, 1))
        return np.where(column, thickness, 0.5 * (shred & (n == 5)))

    shown = np.where(column, colour, edge)[..., None].astype(np.float32)
    plate = plate_of(film(tmp_path, truth, opacity, shown, 0.5))
    inner = np.abs(columns - WIDTH / 2) < 6
    assert plate.confidence[inner].max() < 0.5
    assert np.median(codes_apart(plate.image, truth)[inner]) < 15


def test_what_hardly_changes_is_background_however_unlike_its_surroundings(tmp_path: Path) -> None:
    """A dark jacket before a bright wall that breathes by ten codes, beside a puff."""
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


def test_one_frame_is_its_own_plate(tmp_path: Path) -> None:
    write_image(tmp_path / "still.png", wall(0.2, 0.8))
    clip = Clip.open(tmp_path / "still.png")
    plate = plate_of(clip)
    assert codes_apart(plate.image, clip.frame(0)).max() < 0.1
    assert not matte(clip.frame(0), plate).mask.any()


@pytest.mark.skipif(not DATA.is_dir(), reason="needs the development data")
def test_the_wall_behind_the_synthetic_puff() -> None:
    folder = DATA / "synthetic" / "puff"
    plate = plate_of(Clip.open(folder / "front.mp4"))
    with np.load(folder / "background_plate.npz") as data:
        truth = data[data.files[0]]
    truth = truth if truth.ndim == 3 else truth[..., None].repeat(3, 2)
    apart = np.abs(linear_to_srgb(plate.image) - linear_to_srgb(truth)).mean(axis=2) * 255
    assert np.median(apart) < 1.5
    assert np.percentile(apart, 95) < 4.5
    assert (plate.confidence < 0.5).mean() < 0.05
