"""The clean plate and the matte, on clips whose background and smoke are known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.matte import matte
from smokelift.footage.plate import changing_plate, known_plate
from smokelift.footage.plate_estimation import estimate_plate, one_colour
from smokelift.output.images import write_image

HEIGHT, WIDTH, COUNT = 72, 56, 24
DATA = Path(__file__).parents[3] / "shared" / "data"


def wall(low: float, high: float) -> np.ndarray:
    """Return a textured linear background, the same each time."""
    blocks = np.random.default_rng(0).uniform(low, high, (HEIGHT // 8, WIDTH // 8, 3))
    return srgb_to_linear(np.kron(blocks, np.ones((8, 8, 1))))


def puff(n: int) -> np.ndarray:
    """Return the opacity of a round puff that rises through the picture."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    centre = HEIGHT - 2.5 * n, WIDTH / 2 + 6 * np.sin(n / 3)
    distance = np.hypot(rows - centre[0], columns - centre[1])
    return 0.7 * np.clip(1.5 - distance / 9, 0.0, 1.0) * (1.0 + 0.2 * np.sin(0.9 * n + rows / 3))


def film(
    folder: Path, plate: np.ndarray, opacity: Callable[[int], np.ndarray], colour: float, noise: float = 1.0
) -> Clip:
    """Write and open a clip of smoke of a colour before a plate, with sensor noise in 8 bit codes."""
    random = np.random.default_rng(1)
    for n in range(COUNT):
        alpha = np.clip(opacity(n), 0.0, 1.0)[..., None]
        clean = plate * (1.0 - alpha) + colour * alpha
        codes = linear_to_srgb(clean) + random.normal(0.0, noise / 255, clean.shape)
        write_image(folder / f"frame_{n:03d}.png", srgb_to_linear(np.clip(codes, 0.0, 1.0)))
    return Clip.open(folder / "frame_###.png", fps=24)


def overlap(mask: np.ndarray, truth: np.ndarray) -> float:
    return float((mask & truth).sum() / (mask | truth).sum())


def codes_apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(linear_to_srgb(a) - linear_to_srgb(b)).max(axis=2) * 255


@pytest.mark.parametrize(
    ("low", "high", "colour"),
    [(0.2, 0.5, 0.6), (0.6, 0.9, 0.02), (0.2, 0.9, 0.25)],
    ids=["brightening", "darkening", "both"],
)
def test_plate_and_matte(tmp_path: Path, low: float, high: float, colour: float) -> None:
    truth = wall(low, high)
    clip = film(tmp_path, truth, puff, colour)
    plate = estimate_plate(clip)
    assert plate.image.shape == truth.shape
    assert plate.confidence.shape == truth.shape[:2]
    assert plate.confidence.min() > 0.9
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
        plate = estimate_plate(film(tmp_path / name, flat, puff, 0.8, codes))
        slope = (srgb_to_linear(linear_to_srgb(0.2) + 0.01) - 0.2) / 0.01
        assert plate.noise.shape == (3,)
        np.testing.assert_allclose(plate.noise, max(codes, 1.0) / 255 * slope, rtol=0.25)


def test_pixels_that_are_never_clear_are_filled_and_marked(tmp_path: Path) -> None:
    truth = np.linspace(0.1, 0.3, WIDTH, dtype=np.float32)[None, :, None].repeat(HEIGHT, 0).repeat(3, 2)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    jet = (np.abs(columns - WIDTH / 2) < 5) & (rows > 30)

    def opacity(n: int) -> np.ndarray:
        flicker = np.random.default_rng(n).uniform(0.3, 0.9)
        return np.where(jet, flicker, 0.0)

    clip = film(tmp_path, truth, opacity, 0.9, 0.5)
    plate = estimate_plate(clip)
    inner = (np.abs(columns - WIDTH / 2) < 3) & (rows > 34)
    assert plate.confidence[inner].max() < 0.5
    assert plate.confidence[np.abs(columns - WIDTH / 2) > 8].min() == 1.0
    assert codes_apart(plate.image, truth)[inner].max() < 12
    assert all(matte(clip.frame(n), plate).mask[inner].all() for n in (0, 11, 23))


def test_an_empty_clip_has_no_smoke(tmp_path: Path) -> None:
    truth = wall(0.2, 0.8)
    clip = film(tmp_path, truth, lambda n: np.zeros((HEIGHT, WIDTH)), 1.0, 2.0)
    plate = estimate_plate(clip)
    assert plate.confidence.min() == 1.0
    assert not any(matte(frame, plate).mask.any() for frame in clip)


def test_a_known_black_background(tmp_path: Path) -> None:
    black = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    clip = film(tmp_path, black, puff, 0.5, 0.0)
    plate = known_plate((0.0, 0.0, 0.0), clip)
    assert plate.confidence.min() == 1.0
    np.testing.assert_allclose(plate.noise, 1 / 255 / 12.92, rtol=1e-3)
    for n in (4, 12, 20):
        assert overlap(matte(clip.frame(n), plate).mask, puff(n) > 0.002) > 0.75
    estimated = estimate_plate(clip)
    assert codes_apart(estimated.image, black).max() < 1.0
    picture = known_plate(wall(0.2, 0.5)[::2, ::2], clip)
    assert picture.image.shape == (HEIGHT, WIDTH, 3)


def test_smoke_over_most_of_the_picture_is_not_noise(tmp_path: Path) -> None:
    def billows(n: int) -> np.ndarray:
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        return np.where(columns < 0.65 * WIDTH, 0.3 + 0.25 * np.sin(rows / 4 + 0.8 * n), 0.0)

    for name, behind in (("black", np.zeros((HEIGHT, WIDTH, 3))), ("wall", wall(0.2, 0.5))):
        (tmp_path / name).mkdir()
        clip = film(tmp_path / name, behind, billows, 0.9)
        plate = known_plate(behind, clip)
        noise = linear_to_srgb(np.median(behind, axis=(0, 1)) + plate.noise) - linear_to_srgb(
            np.median(behind, axis=(0, 1))
        )
        assert 0.5 < noise.mean() * 255 < 2.0
        for n in (4, 12, 20):
            assert overlap(matte(clip.frame(n), plate).mask, billows(n) > 0.002) > 0.9


def test_one_frame_is_its_own_plate(tmp_path: Path) -> None:
    write_image(tmp_path / "still.png", wall(0.2, 0.8))
    clip = Clip.open(tmp_path / "still.png")
    plate = estimate_plate(clip)
    assert codes_apart(plate.image, clip.frame(0)).max() < 0.1
    assert not matte(clip.frame(0), plate).mask.any()


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    write_image(tmp_path / "still.png", wall(0.2, 0.8))
    clip = Clip.open(tmp_path / "still.png")
    plate = estimate_plate(clip)
    with pytest.raises(ValueError, match="one shape"):
        matte(clip.frame(0)[1:], plate)
    with pytest.raises(ValueError, match="finite"):
        matte(clip.frame(0) * np.nan, plate)
    for background in ((1.0, 2.0), np.full((4, 4, 3), np.nan), np.ones((4, 4))):
        with pytest.raises(ValueError, match="finite colour or RGB picture"):
            known_plate(background, clip)


def pan(folder: Path, wide: np.ndarray, smoke: float) -> Clip:
    """Write and open a clip in which a wide background passes by behind smoke."""
    random = np.random.default_rng(2)
    for n in range(COUNT):
        alpha = np.clip(smoke * puff(n), 0.0, 1.0)[..., None]
        codes = linear_to_srgb(wide[:, 2 * n : 2 * n + WIDTH] * (1.0 - alpha) + 0.6 * alpha)
        codes = codes + random.normal(0.0, 1.0 / 255, codes.shape)
        write_image(folder / f"frame_{n:03d}.png", srgb_to_linear(np.clip(codes, 0.0, 1.0)))
    return Clip.open(folder / "frame_###.png", fps=24)


def passing_wall() -> np.ndarray:
    """Return a textured linear background that is wide enough for a pan."""
    blocks = np.random.default_rng(0).uniform(0.2, 0.5, (HEIGHT // 8, (WIDTH + 2 * COUNT) // 8, 3))
    return srgb_to_linear(np.kron(blocks, np.ones((8, 8, 1))))


@pytest.mark.parametrize("colour", [(0.0, 0.0, 0.0), (0.1, 0.3, 0.05)], ids=["black", "green"])
def test_one_colour_behind_a_moving_camera_is_found(tmp_path: Path, colour: tuple[float, float, float]) -> None:
    wide = np.broadcast_to(colour, (HEIGHT, WIDTH + 2 * COUNT, 3))
    found = one_colour(estimate_plate(pan(tmp_path, wide, 1.0)))
    assert found == pytest.approx(colour, abs=0.003)


@pytest.mark.parametrize("smoke", [0.0, 1.0])
def test_more_than_one_colour_behind_a_moving_camera_is_told(tmp_path: Path, smoke: float) -> None:
    assert one_colour(estimate_plate(pan(tmp_path, passing_wall(), smoke))) is None


def test_a_slope_behind_a_moving_camera_is_not_one_colour(tmp_path: Path) -> None:
    """It passes up and down, so no pixel changes, and yet there are many colours."""
    wide = np.broadcast_to(np.linspace(0.1, 0.3, HEIGHT)[:, None, None], (HEIGHT, WIDTH + 2 * COUNT, 3))
    assert one_colour(estimate_plate(pan(tmp_path, wide, 1.0))) is None


def test_a_plate_for_every_frame(tmp_path: Path) -> None:
    """Each frame has its own, the noise is that of the difference, and the smoke is found before it."""
    (tmp_path / "clip").mkdir()
    (tmp_path / "plate").mkdir()
    wide = passing_wall()
    clip = pan(tmp_path / "clip", wide, 1.0)
    plates = pan(tmp_path / "plate", wide, 0.0)
    changing = changing_plate(plates, clip)
    slope = (srgb_to_linear(linear_to_srgb(0.1) + 0.01) - 0.1) / 0.01
    for n in (4, 12, 20):
        plate = changing.at(n)
        assert codes_apart(plate.image, wide[:, 2 * n : 2 * n + WIDTH]).max() < 6
        assert plate.noise.mean() < 2.5 / 255 * slope
        mask = matte(clip.frame(n), plate).mask
        assert mask[puff(n) > 0.3].mean() > 0.95
        assert mask[puff(n) == 0.0].mean() < 0.08


def test_plates_are_counted_as_the_clips_file(tmp_path: Path) -> None:
    """A part of the clip has that part of the plates; too few are refused."""
    for name in ("clip", "plate"):
        (tmp_path / name).mkdir()
    wide = passing_wall()
    pan(tmp_path / "clip", wide, 1.0)
    plates = pan(tmp_path / "plate", wide, 0.0)
    late = Clip.open(tmp_path / "clip" / "frame_###.png", fps=24, frames=(10, 15))
    assert codes_apart(changing_plate(plates, late).at(2).image, wide[:, 24 : 24 + WIDTH]).max() < 6
    few = Clip.open(tmp_path / "plate" / "frame_###.png", fps=24, frames=(0, 12))
    with pytest.raises(ValueError, match="has 13 of the frames 0 to 15 that are needed"):
        changing_plate(few, late)


@pytest.mark.skipif(not DATA.is_dir(), reason="needs the development data")
def test_the_wall_behind_the_synthetic_puff() -> None:
    folder = DATA / "synthetic" / "puff"
    plate = estimate_plate(Clip.open(folder / "front.mp4"))
    with np.load(folder / "background_plate.npz") as data:
        truth = data[data.files[0]]
    truth = truth if truth.ndim == 3 else truth[..., None].repeat(3, 2)
    apart = np.abs(linear_to_srgb(plate.image) - linear_to_srgb(truth)).mean(axis=2) * 255
    assert np.median(apart) < 1.5
    assert np.percentile(apart, 95) < 4.0
    assert (plate.confidence < 0.5).mean() < 0.01
