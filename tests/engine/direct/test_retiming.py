"""Sequences at another speed."""

import numpy as np
import pytest

from smokelift.direct.retiming import playback, retime_sequence
from smokelift.output.sequence import Sequence


def test_a_speed_shows_every_frame_once():
    places, speeds = playback(5, (1.0,))
    np.testing.assert_allclose(places, [0, 1, 2, 3, 4])
    np.testing.assert_allclose(speeds, 1)
    np.testing.assert_allclose(playback(5, (0.5,))[0], np.arange(9) / 2)
    np.testing.assert_allclose(playback(5, (2.0,))[0], [0, 2, 4])
    places, speeds = playback(11, (1.0, 0.25))
    assert np.all(np.diff(places) < 1.01)
    assert np.all(np.diff(np.diff(places)) < 0)
    assert speeds[0] == 1
    assert speeds[-1] < 0.4


def test_a_sequence_at_half_its_speed(source, tmp_path):
    for number, _ in retime_sequence(source, tmp_path / "slow", (0.5,), npz=True):
        if number == 3:
            break
    assert len(list(retime_sequence(source, tmp_path / "slow", (0.5,), npz=True, resume=True))) == 16
    slow = Sequence.open(tmp_path / "slow")
    assert slow.frames == tuple(range(1, 20))
    for number in source.frames:
        np.testing.assert_allclose(slow.density(2 * number - 1), source.density(number), rtol=1e-6)
        found, known = slow.velocity(2 * number - 1), source.velocity(number)
        np.testing.assert_allclose(found.centres(), 0.5 * known.centres(), atol=1e-5)
    masses = [slow.figures(number)["mass"] for number in (3, 4, 5)]
    assert masses[1] == pytest.approx((masses[0] + masses[2]) / 2, rel=0.02)
    assert max(slow.figures(number)["divergence"] for number in slow.frames) < 1e-3
