"""Backgrounds of one colour."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from films import COUNT, HEIGHT, WIDTH, codes_apart, film, pan, passing_wall, puff, wall

from smokelift.footage.backdrop import colour_around, one_colour
from smokelift.footage.matte import matte
from smokelift.footage.plate_estimation import estimate_plate


def spreading_ink(n: int) -> np.ndarray:
    """Return the opacity of ink that spreads from above, faster at first, and stays."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return np.clip((62 * np.sqrt(n / COUNT) - rows - 6 * np.cos(columns / 4)) / 6, 0, 1) if n else 0.0 * rows


@pytest.mark.parametrize(("colour", "ink"), [(1.0, 0.0), (0.2, 0.7)], ids=["black on white", "bright on grey"])
def test_ink_that_stays_is_not_what_it_hides(tmp_path: Path, colour: float, ink: float) -> None:
    """Ink is over more of the picture that never changes than what it spreads over."""
    truth = np.full((HEIGHT, WIDTH, 3), colour)
    clip = film(tmp_path, truth, spreading_ink, ink)
    plate = estimate_plate(clip)
    assert (plate.confidence == 1).all()
    assert codes_apart(plate.image, truth).max() < 2
    last = spreading_ink(COUNT - 1)
    mask = matte(clip.frame(COUNT - 1), plate).mask
    assert mask[last > 0.5].all()
    assert mask.mean() < (last > 0).mean() + 0.1


def test_a_clip_that_fades_in_from_black_is_not_before_black(tmp_path: Path) -> None:
    """Its bar is black all the time, and all of it at first."""
    truth = np.full((HEIGHT, WIDTH, 3), 0.4)
    truth[:10] = 0
    plate = estimate_plate(film(tmp_path, truth, lambda n: np.full((HEIGHT, WIDTH), max(1 - n / 2, 0)), 0.0))
    assert np.median(codes_apart(plate.image, truth)) < 2


def mist(n: int) -> np.ndarray:
    """Return the opacity of mist over two thirds of the picture that hardly moves."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    depth = np.clip(rows / HEIGHT - 0.33, 0, 0.67) / 0.67
    return 0.5 * depth**2 * (3 - 2 * depth) * (1 + 0.2 * np.sin(columns / 9 + 0.02 * n))


def test_mist_that_hardly_moves_is_before_the_black_that_it_fades_into(tmp_path: Path) -> None:
    """It changes as little as a wall, and is most of what does not change."""
    clip = film(tmp_path, np.zeros((HEIGHT, WIDTH, 3)), mist, 0.4, 0.5)
    plate = estimate_plate(clip)
    assert (plate.confidence == 1).all()
    assert not plate.image.any()
    assert matte(clip.frame(12), plate).mask[HEIGHT * 2 // 3 :].all()


@pytest.mark.parametrize("lit", [False, True], ids=["bars", "spot"])
def test_what_has_edges_is_no_mist(tmp_path: Path, lit: bool) -> None:
    """Black bars, and a wall that a spot lights, are as black as what mist is before."""
    truth = wall(0.2, 0.5)
    truth[:10] = 0
    truth[-10:] = 0
    if lit:
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        truth = wall(0.2, 0.5) * np.exp(-((rows - 36) ** 2 + (columns - 28) ** 2) / 150)[..., None]
    plate = estimate_plate(film(tmp_path, truth, puff, 0.6, 0.5))
    middle = np.s_[28:44, 20:36]
    assert codes_apart(plate.image, truth)[middle].max() < 30
    assert plate.image[middle].min() > 0


@pytest.mark.parametrize("colour", [(0.0, 0.0, 0.0), (0.1, 0.3, 0.05)], ids=["black", "green"])
def test_one_colour_behind_a_moving_camera_is_found(tmp_path: Path, colour: tuple[float, float, float]) -> None:
    wide = np.broadcast_to(colour, (HEIGHT, WIDTH + 2 * COUNT, 3))
    found = one_colour(estimate_plate(pan(tmp_path, wide, 1.0)))
    assert found == pytest.approx(colour, abs=0.003)


@pytest.mark.parametrize("smoke", [0.0, 1.0])
def test_more_than_one_colour_behind_a_moving_camera_is_noticed(tmp_path: Path, smoke: float) -> None:
    assert one_colour(estimate_plate(pan(tmp_path, passing_wall(), smoke))) is None


def test_a_slope_behind_a_moving_camera_is_not_one_colour(tmp_path: Path) -> None:
    """It passes up and down, so no pixel changes, and yet there are many colours."""
    wide = np.broadcast_to(np.linspace(0.1, 0.3, HEIGHT)[:, None, None], (HEIGHT, WIDTH + 2 * COUNT, 3))
    assert one_colour(estimate_plate(pan(tmp_path, wide, 1.0))) is None


def test_a_single_picture_has_a_colour_around_it() -> None:
    """In noise, too, behind smoke that covers most of it and comes in from one side; not a wall, and no black bars."""
    picture = np.full((60, 80, 3), 0.2, np.float32)
    picture += np.random.default_rng(0).normal(0, 0.004, picture.shape).astype(np.float32)
    picture[5:, 10:70] = np.linspace(0.3, 0.9, 60)[:, None]
    assert colour_around(picture) == pytest.approx((0.2, 0.2, 0.2), abs=0.002)
    picture[:, 10:70] = np.linspace(0.3, 0.9, 60)[:, None]
    assert colour_around(picture) is None
    bars = np.kron(np.random.default_rng(0).uniform(0.1, 0.6, (12, 16, 1)), np.ones((5, 5, 3))).astype(np.float32)
    assert colour_around(bars) is None
    bars[:10] = bars[-10:] = 0
    assert colour_around(bars) is None
