"""Whether the camera of a clip moves."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.footage.camera_motion import moves
from smokelift.footage.images import srgb_to_linear

COUNT, SIZE, MARGIN = 12, (120, 160), 40


def filmed(
    shifts: np.ndarray, parallax: float = 0.0, smoke: float = 0.0, noise: float = 1.0, contrast: float = 1.0
) -> np.ndarray:
    """Return frames of a wall, linear, each from another place (down, right); parallax adds to it towards the floor.

    The smoke, up to so opaque, boils over a quarter of the picture. Noise is in 8 bit codes.
    """
    random = np.random.default_rng(0)
    shape = (SIZE[0] + 2 * MARGIN, SIZE[1] + 2 * MARGIN)
    texture = sum(ndimage.gaussian_filter(random.standard_normal(shape), s) * s for s in (1.0, 3.0))
    wall = 0.4 + 0.12 * contrast * texture
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    boil = ndimage.gaussian_filter(random.standard_normal((len(shifts), *SIZE)), (1, 6, 6))
    opacity = smoke * np.clip(0.5 + 0.5 * boil / boil.std(), 0, 1) * (abs(columns - SIZE[1] / 2) < SIZE[1] / 8)
    seen = []
    for (down, right), cover in zip(shifts, opacity, strict=True):
        at = [rows + MARGIN + down, columns + MARGIN + right * (1 + parallax * rows / SIZE[0])]
        behind = ndimage.map_coordinates(wall, at, order=3)
        seen.append(behind * (1 - cover) + 0.9 * cover)
    codes = np.stack(seen)[..., None] + random.normal(0, noise / 255, (len(seen), *SIZE, 3))
    return srgb_to_linear(np.clip(codes, 0, 1))


STILL = np.zeros((COUNT, 2))
ALONG = np.stack([np.zeros(COUNT), np.linspace(-0.5, 0.5, COUNT)], 1)
SHAKE = np.random.default_rng(2).uniform(-3, 3, (COUNT, 2))


@pytest.mark.parametrize("shifts", [SHAKE, 30 * ALONG, 6 * ALONG], ids=["shakes", "pans", "drifts"])
def test_a_camera_that_moves_is_seen_behind_smoke(shifts: np.ndarray) -> None:
    assert moves(filmed(shifts, smoke=0.9))


def test_a_camera_that_travels_is_seen() -> None:
    assert moves(filmed(20 * ALONG, parallax=1.0))


@pytest.mark.parametrize(("smoke", "noise"), [(0.0, 1.0), (1.0, 1.0), (1.0, 12.0)])
def test_a_still_camera_does_not_move(smoke: float, noise: float) -> None:
    assert not moves(filmed(STILL, smoke=smoke, noise=noise))


def test_a_knock_is_no_camera_that_moves() -> None:
    assert not moves(filmed(np.where(np.arange(COUNT)[:, None] == 3, [[0.0, 8.0]], 0.0), smoke=0.9))


def test_a_camera_that_hardly_moves_does_not() -> None:
    assert not moves(filmed(0.6 * ALONG))


def test_smoke_before_one_colour_is_no_camera() -> None:
    assert not moves(filmed(SHAKE, smoke=1.0, contrast=0.0))


def test_one_frame_tells_nothing() -> None:
    assert not moves(filmed(STILL[:1]))
