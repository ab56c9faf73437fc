"""Clips whose exposure changes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from films import COUNT, codes_apart, film, overlap, puff, wall

from smokelift.footage.clip import Clip
from smokelift.footage.matte import matte
from smokelift.footage.plate import known_plate
from smokelift.footage.plate_estimation import estimate_plate
from smokelift.footage.steady import steady


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
    plate = estimate_plate(changing)
    found = steady(changing, plate)
    for n in (4, 8, 20):
        assert overlap(matte(found.frame(n), plate).mask, puff(n) > 0.05) > 0.7
