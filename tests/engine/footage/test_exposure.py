"""The gain of a frame against its background."""

import numpy as np
import pytest

from smokelift.footage.noise import gain_of, sample_gains, shows_exposure
from tests.engine.films import HEIGHT, WIDTH, puff, wall

GAINS = np.array([1.3, 1.0, 0.8], np.float32)


def test_a_gain_is_found_beside_smoke_which_is_none() -> None:
    behind = wall(0.3, 0.7).astype(np.float32)
    alpha = puff(12)[..., None]
    seen = (behind * (1 - alpha) + 0.4 * alpha) * GAINS
    np.testing.assert_allclose(gain_of(seen.astype(np.float32), behind), GAINS, rtol=0.01)
    black = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    assert (gain_of(black + 0.3, black) == 1).all()
    rows = np.arange(HEIGHT)[:, None, None]
    assert (gain_of(np.where(rows < 0.85 * HEIGHT, 0.5 * behind + 0.2, behind), behind) == 1).all()


def test_a_flash_has_its_own_gain() -> None:
    frames = np.repeat(wall(0.2, 0.4).astype(np.float32)[None], 9, 0)
    frames[4] *= 3
    gains = sample_gains(frames)
    np.testing.assert_allclose(gains[4], 3, rtol=0.01)
    assert (np.delete(gains, 4, 0) == 1).all()


@pytest.mark.parametrize(("value", "shown"), [(0.0, False), (0.002, False), (0.2, True), (1.0, False)])
def test_black_and_white_show_no_exposure(value, shown) -> None:
    background = np.full((40, 60, 3), value, np.float32)
    assert shows_exposure(background) is shown
    background[:6, :6] = 0.3
    assert shows_exposure(background)
