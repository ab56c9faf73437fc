"""Backgrounds of one colour, found on pictures smaller than the clip's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from films import wall

from smokelift.footage.clip import Clip
from smokelift.footage.evidence import GLIMPSE
from smokelift.footage.images import Picture, linear_to_srgb, srgb_to_linear
from smokelift.footage.plain import plain_plate
from smokelift.footage.plate_estimation import estimate_plate
from smokelift.output.images import write_image

COUNT = 8
SIZE = (45, 2 * GLIMPSE + 3)


def clip(folder: Path, behind: Picture, noise: float = 1.0, flash: float = 1.0) -> Clip:
    """Return a wide clip of a bright patch that wanders over a background, with noise in codes."""
    random = np.random.default_rng(0)
    for n in range(COUNT):
        picture = np.broadcast_to(behind, (*SIZE, 3)).copy()
        picture[10:30, 150 * n : 150 * n + 100] = 0.6
        picture *= flash if n == COUNT // 2 else 1
        codes = linear_to_srgb(picture) + random.normal(0, noise / 255, picture.shape)
        write_image(folder / f"frame_{n}.png", srgb_to_linear(np.clip(codes, 0, 1)))
    return Clip.open(folder / "frame_#.png", fps=24)


@pytest.mark.parametrize("colour", [(0.0, 0.0, 0.0), (0.1, 0.3, 0.05)], ids=["black", "green"])
@pytest.mark.parametrize(("noise", "flash"), [(1.0, 1.0), (3.0, 0.5)])
def test_one_colour_is_found_as_on_all_pixels(
    tmp_path: Path, colour: tuple[float, float, float], noise: float, flash: float
) -> None:
    shown = clip(tmp_path, np.array(colour, np.float32), noise, flash)
    plain, whole = plain_plate(shown, shown), estimate_plate(shown)
    assert plain is not None
    assert plain.image.shape == (*SIZE, 3)
    assert (plain.confidence == 1).all()
    assert np.abs(linear_to_srgb(plain.image) - linear_to_srgb(whole.image)).max() < 0.2 / 255
    np.testing.assert_allclose(plain.noise.total, whole.noise.total, rtol=0.05)


def test_what_stands_before_one_colour_is_no_plain_background(tmp_path: Path) -> None:
    behind = np.full((*SIZE, 3), 0.1, np.float32)
    behind[33:40, 700:702] = 0.5
    shown = clip(tmp_path, behind)
    assert plain_plate(shown, shown) is None


def test_a_wall_is_no_plain_background(tmp_path: Path) -> None:
    behind = np.tile(wall(0.2, 0.5), (1, 40, 1))[: SIZE[0], : SIZE[1]]
    shown = clip(tmp_path, behind)
    assert plain_plate(shown, shown) is None


def test_small_pictures_are_looked_at_whole(tmp_path: Path) -> None:
    write_image(tmp_path / "frame_0.png", np.zeros((8, 2 * GLIMPSE - 2, 3), np.float32))
    shown = Clip.open(tmp_path / "frame_#.png", fps=24)
    assert plain_plate(shown, shown) is None
