"""Cuts are told from what passes, from exposure and from what always moves."""

from __future__ import annotations

import numpy as np
import pytest
from films import HEIGHT, WIDTH, puff

from smokelift.footage.cut import find_cut

COUNT = 12


def scene(seed: int) -> np.ndarray:
    """A wall of blocks, linear, another with each seed."""
    blocks = np.random.default_rng(seed).uniform(0.05, 0.5, (HEIGHT // 8, WIDTH // 8, 3))
    return np.kron(blocks, np.ones((8, 8, 1))).astype(np.float32)


def frame(number: int, wall: np.ndarray) -> np.ndarray:
    """A puff that rises before it."""
    opacity = puff(2 * number)[..., None]
    return np.asarray(wall * (1 - opacity) + 0.6 * opacity, np.float32)


def cut_of(frames: list[np.ndarray], numbers: list[int] | None = None) -> int | None:
    numbers = list(range(len(frames))) if numbers is None else numbers
    return find_cut(numbers, [frames[number] for number in numbers], frames.__getitem__)


@pytest.mark.parametrize("after", [2, 7, 10])
@pytest.mark.parametrize("apart", [1, 3])
def test_a_cut_is_found_to_the_frame(after: int, apart: int) -> None:
    """Between samples, too."""
    frames = [frame(n, scene(0 if n < 3 * after else 1)) for n in range(3 * COUNT)]
    numbers = list(range(1, 3 * COUNT, 3)) if apart == 3 else list(range(3 * COUNT))
    assert cut_of(frames, numbers) == 3 * after


def test_nothing_else_is_a_cut() -> None:
    """A shot, a flash, two flashes in a row, a step of the exposure, a camera that pans, noise, smoke over all."""
    wall = scene(0)
    shot = [frame(n, wall) for n in range(COUNT)]
    assert cut_of(shot) is None
    for flashes in ((6,), (6, 7)):
        assert cut_of([picture * (3 if n in flashes else 1) for n, picture in enumerate(shot)]) is None
    assert cut_of([picture * (1.6 if n > 5 else 1) for n, picture in enumerate(shot)]) is None
    assert cut_of([frame(n, np.roll(wall, 5 * n, 1)) for n in range(COUNT)]) is None
    random = np.random.default_rng(0)
    assert cut_of([picture + random.normal(0, 0.1, picture.shape).astype(np.float32) for picture in shot]) is None
    thick = [
        0.1 * wall + 0.6 + 0.2 * np.sin(n + np.arange(WIDTH) / 5)[:, None].astype(np.float32) for n in range(COUNT)
    ]
    assert cut_of([*shot[:6], *thick[6:]]) is None
    assert cut_of(shot[:2]) is None
