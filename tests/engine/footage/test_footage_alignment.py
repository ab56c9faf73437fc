"""How far a camera has turned between two pictures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from turning_camera import LENS, off, pictures, wall

from smokelift.footage.alignment import align, judged, levels, points_of

HALF = Rotation.concatenate([Rotation.identity(), Rotation.from_rotvec([0.012, -0.021, 0.03])])


@pytest.mark.parametrize("smoke", [0.0, 0.9], ids=["clear", "smoke over a third"])
def test_a_known_turn_is_found(smoke: float) -> None:
    """To a tenth of a pixel in the farthest corner, whatever moves by itself."""
    frames, _ = pictures(wall(), HALF, smoke)
    first, second = (levels(frame, LENS) for frame in frames)
    found = align(points_of(first), second, Rotation.identity())
    assert off(Rotation.concatenate([found.turn]), Rotation.concatenate([HALF[1].inv()])) < 0.1
    assert found.same > 0.5
    assert judged(points_of(first)[-1], second[-1], Rotation.identity()).same < 0.1


def test_without_texture_nothing_is_the_same() -> None:
    """Noise alone agrees with nothing, turned or not."""
    frames, _ = pictures(np.full_like(wall(), 0.3), HALF, noise=2.0)
    first, second = (levels(frame, LENS) for frame in frames)
    assert align(points_of(first), second, Rotation.identity()).same == 0.0


def test_a_picture_that_is_turned_away_shares_nothing() -> None:
    frames, _ = pictures(wall(), HALF)
    first, second = (levels(frame, LENS) for frame in frames)
    away = judged(points_of(first)[-1], second[-1], Rotation.from_rotvec([0, 1.2, 0]))
    assert (away.same, away.shared) == (0.0, 0.0)
