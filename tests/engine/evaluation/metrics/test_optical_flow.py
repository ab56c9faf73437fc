"""Optical flow of known shifts, and what it says about smoke that does not flow."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from smokelift.evaluation.metrics import carried, optical_flow, picture_motion

SHAPE = (96, 64)
INSIDE = np.s_[20:76, 20:44]


def texture(seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).standard_normal((140, 108))
    return ndimage.gaussian_filter(noise, 3) / 0.1 + ndimage.gaussian_filter(noise, 1.5) / 0.3


def shown(texture: np.ndarray, down: float, right: float) -> np.ndarray:
    """The texture's middle, moved by so many pixels."""
    rows, columns = np.indices(SHAPE)
    return ndimage.map_coordinates(texture, (rows + 22 - down, columns + 22 - right), order=3)


def smoke(seed: int = 0, down: float = 0.0) -> np.ndarray:
    """A ball with texture that moves together."""
    rows, columns = np.indices(SHAPE)
    ball = np.exp(-(((rows - 48 - down) / 22) ** 2) - ((columns - 32) / 14) ** 2)
    return ball * (3 + 0.5 * shown(texture(seed), down, 0.0))


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.4, -0.7), (-3.0, 2.0), (6.5, -4.0)])
def test_a_shift_is_found_at_the_points_of_arrival(shift) -> None:
    still = texture()
    flow = optical_flow(shown(still, 0, 0), shown(still, *shift))
    np.testing.assert_allclose(np.median(flow[INSIDE], (0, 1)), shift, atol=0.05)
    assert np.abs(flow[INSIDE] - shift).mean() < 0.15


def test_a_turn_is_found() -> None:
    """Four degrees about the middle: no divergence, and a curl of twice the angle."""
    rows, columns = np.indices(SHAPE) - np.array([48, 32])[:, None, None]
    angle = np.deg2rad(4)
    origins = np.cos(angle) * rows - np.sin(angle) * columns, np.sin(angle) * rows + np.cos(angle) * columns
    still = texture()
    turned = ndimage.map_coordinates(still, [o + c for o, c in zip(origins, (70, 54), strict=True)], order=3)
    flow = optical_flow(shown(still, 0, 0), turned)
    curl = np.gradient(flow[..., 0], axis=1) - np.gradient(flow[..., 1], axis=0)
    spread = np.gradient(flow[..., 0], axis=0) + np.gradient(flow[..., 1], axis=1)
    assert curl[INSIDE].mean() == pytest.approx(2 * np.sin(angle), rel=0.1)
    assert abs(spread[INSIDE].mean()) < 0.02


def test_a_picture_without_change_in_space_has_no_flow() -> None:
    assert np.abs(optical_flow(np.zeros(SHAPE), np.zeros(SHAPE))).max() == 0
    assert np.abs(optical_flow(np.ones(SHAPE), 1.1 * np.ones(SHAPE))).max() == 0


def test_carrying_moves_a_picture_along() -> None:
    rows, _ = np.indices(SHAPE)
    moved = carried(rows, np.full((*SHAPE, 2), (2.0, 5.0)))
    np.testing.assert_allclose(moved[4:], rows[4:] - 2)


def test_smoke_that_flows_and_smoke_that_pops() -> None:
    """New detail in every frame is no motion: the flow cannot carry it, and diverges where it tries."""
    flowing, popping = picture_motion(smoke(), smoke(down=2.0)), picture_motion(smoke(), smoke(seed=7))
    assert flowing.speed == pytest.approx(2.0, rel=0.1)
    assert flowing.warp_error < 0.15
    assert popping.warp_error > 4 * flowing.warp_error
    assert popping.divergence > 3 * flowing.divergence


def test_brightness_does_not_matter_to_motion() -> None:
    dim, bright = (picture_motion(f * smoke(), f * smoke(down=1.0)) for f in (0.01, 100))
    assert dim.speed == pytest.approx(bright.speed)
    assert dim.warp_error == pytest.approx(bright.warp_error)


def test_a_picture_without_smoke_has_no_motion() -> None:
    assert picture_motion(smoke(), np.zeros(SHAPE)) is None


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValueError, match="shapes must be equal"):
        optical_flow(np.ones((8, 8)), np.ones((8, 9)))
    with pytest.raises(ValueError, match="finite"):
        picture_motion(np.ones((8, 8)), np.full((8, 8), np.inf))
