"""Where a frame shows smoke."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from films import HEIGHT, WIDTH, film, overlap, wall

from smokelift.footage.matte import MOST_SMOOTHING, SMOOTHING, matte, smoothing
from smokelift.footage.noise import Noise, lasting_noise
from smokelift.footage.plate import known_plate
from smokelift.footage.plate_estimation import estimate_plate
from smokelift.footage.steady import without_noise_light


def test_an_empty_clip_has_no_smoke(tmp_path: Path) -> None:
    truth = wall(0.2, 0.8)
    clip = film(tmp_path, truth, lambda n: np.zeros((HEIGHT, WIDTH)), 1.0, 2.0)
    plate = estimate_plate(clip)
    assert plate.confidence.min() == 1.0
    assert not any(matte(frame, plate).mask.any() for frame in clip)


def test_smoke_over_most_of_the_picture_is_not_noise(tmp_path: Path) -> None:
    def billows(n: int) -> np.ndarray:
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        return np.where(columns < 0.65 * WIDTH, 0.3 + 0.25 * np.sin(rows / 4 + 0.8 * n), 0.0)

    for name, behind in (("black", np.zeros((HEIGHT, WIDTH, 3))), ("wall", wall(0.2, 0.5))):
        (tmp_path / name).mkdir()
        clip = film(tmp_path / name, behind, billows, 0.9)
        plate = known_plate(behind, clip)
        assert 0.5 < plate.noise.total.mean() * 255 < 2.0
        for n in (4, 12, 20):
            assert overlap(matte(clip.frame(n), plate).mask, billows(n) > 0.002) > 0.9


def test_noise_is_smoothed_as_far_as_that_helps() -> None:
    """Clean pictures stay sharp; noise that neighbours share is not lessened by it."""
    codes = np.full(3, 1 / 255, np.float32)
    assert smoothing(lasting_noise(0.1)) == smoothing(Noise(2 * codes, codes)) == SMOOTHING
    assert SMOOTHING < smoothing(Noise(10 * codes, codes)) < MOST_SMOOTHING
    assert smoothing(Noise(50 * codes, codes)) == MOST_SMOOTHING


def test_faint_smoke_is_seen_in_noise(tmp_path: Path) -> None:
    """A veil too faint for the noise of single pixels, before a wall that is given."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    veil = np.where(np.hypot(rows - 36, columns - 28) < 16, 0.09, 0.0)
    truth = wall(0.2, 0.3)
    clip = film(tmp_path, truth, lambda n: veil, 0.6, 25.0)
    plate = known_plate(truth, clip)
    found = matte(without_noise_light(clip, plate).frame(5), plate).mask
    assert overlap(found, veil > 0) > 0.7
