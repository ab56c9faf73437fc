"""Clips whose exposure changes, and clips brightened by their noise."""

from pathlib import Path

import numpy as np
import pytest
from films import COUNT, codes_apart, film, overlap, plate_of, puff, wall

from smokelift.footage.clip import Clip
from smokelift.footage.matte import matte
from smokelift.footage.plate import known_plate
from smokelift.footage.steady import steady, without_noise_light


def unsteady(clip: Clip) -> Clip:
    """With a step in the middle, and a flash."""
    return clip.changed(lambda n, picture: picture * (1.5 if n == 4 else 1.0 if n < COUNT // 2 else 0.7))


def test_every_frame_gets_the_exposure_of_its_background(tmp_path: Path) -> None:
    truth = wall(0.2, 0.5)
    clip = film(tmp_path, truth, puff, 0.6)
    changing = unsteady(clip)
    known = steady(changing, known_plate(truth, changing))
    for n in (4, 8, 20):
        assert np.median(codes_apart(known.frame(n), clip.frame(n))) < 1.5


def test_the_smoke_of_no_frame_is_lost(tmp_path: Path) -> None:
    changing = unsteady(film(tmp_path, wall(0.2, 0.5), puff, 0.6))
    plate = plate_of(changing)
    found = steady(changing, plate)
    for n in (4, 8, 20):
        assert overlap(matte(found.frame(n), plate).mask, puff(n) > 0.05) > 0.7


def test_frames_whose_exposure_is_known_are_not_examined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    truth = wall(0.2, 0.5)
    clip = film(tmp_path, truth, puff, 0.6)
    known = {2: np.ones(3, np.float32), 3: np.full(3, 2, np.float32)}
    even = steady(clip, known_plate(truth, clip), known)
    monkeypatch.setattr("smokelift.footage.clip.reduced_size", lambda *_: pytest.fail("examined"))
    assert np.array_equal(even.frame(2), clip.frame(2))
    assert np.array_equal(even.frame(3), clip.frame(3) / 2)
    with pytest.raises(pytest.fail.Exception):
        even.frame(4)


def test_noise_does_not_brighten_a_clip(tmp_path: Path) -> None:
    """The mean of noisy sRGB values is brighter in linear light, and what is brighter would count as smoke."""
    truth = wall(0.2, 0.6)
    noisy = film(tmp_path, truth, lambda n: np.zeros(truth.shape[:2]), 0.6, 25.0)
    quiet = without_noise_light(noisy, known_plate(truth, noisy).noise)
    before, after = (np.mean(list(clip), axis=(0, 1, 2)) - truth.mean((0, 1)) for clip in (noisy, quiet))
    assert before.min() > 0.005
    assert np.abs(after).max() < 0.1 * before.min()
