"""Sequences at another speed; loops: what they keep, and their seam."""

import numpy as np
import pytest

from smokelift import Sequence, Velocity
from smokelift.direct.retiming import loop_sequence, mix_by_edges, playback, retime_sequence, seam
from smokelift.direct.state import SmokeState, read_state
from smokelift.scene import SIDES, Domain
from tests.engine.direct import rising
from tests.engine.direct.rising import DOMAIN, DT, blob


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
    assert (slow.provenance[-1]["what"], slow.provenance[-1]["kind"]) == ("retime", "interpolated frames")
    for number in source.frames:
        np.testing.assert_allclose(slow.density(2 * number - 1), source.density(number), rtol=1e-6)
        found, known = slow.velocity(2 * number - 1), source.velocity(number)
        np.testing.assert_allclose(found.centres(), 0.5 * known.centres(), atol=1e-5)
    masses = [slow.figures(number)["mass"] for number in (3, 4, 5)]
    assert masses[1] == pytest.approx((masses[0] + masses[2]) / 2, rel=0.02)
    assert max(slow.figures(number)["divergence"] for number in slow.frames) < 1e-3


def test_a_seam_moves_a_shape_instead_of_fading_it(monkeypatch):
    domain = Domain(DOMAIN.min, DOMAIN.max, (32, 32, 48))
    monkeypatch.setattr(rising, "DOMAIN", domain)
    way = 8 * domain.voxel_size
    still = Velocity.zero(domain.shape, domain.voxel_size, ("z-",))
    end, start = (SmokeState(blob((x, 0, 1), 0.25), still) for x in (-way / 2, way / 2))
    found = seam(end, start, 0.5, 12 * DT)
    true = blob((0, 0, 1), 0.25)
    faded = (end.density + start.density) / 2
    error, of_fading = (np.linalg.norm(d - true) / np.linalg.norm(true) for d in (found.density, faded))
    assert error < 0.6 * of_fading
    assert found.density.sum() == pytest.approx(true.sum(), rel=0.02)
    speed = (found.velocity.centres()[..., 0] * true).sum() / true.sum()
    assert speed == pytest.approx(way / (12 * DT), rel=0.3)


def test_smoke_that_one_end_has_alone_goes_by_its_edges():
    """Half way its dense middle stands nearly as it was, and its thin rim is gone; what both have stays as it is."""
    both, alone = blob((-0.5, 0.0, 1.0), 0.2), blob((0.5, 0.0, 1.0), 0.2)
    np.testing.assert_allclose(mix_by_edges(both, both, 0.3), both, rtol=1e-5)
    found = mix_by_edges(both + alone, both, 0.5, SIDES)
    left = np.divide(found - both, alone, out=np.zeros_like(alone), where=alone > 0)
    assert left[alone > 0.5].min() > 0.6
    assert left[(alone > 0.01) & (alone < 0.05) & (both == 0)].max() < 0.2
    assert found.sum() == pytest.approx((both + 0.5 * alone).sum(), rel=1e-4)
    for fraction, is_left in ((0.0, both + alone), (1.0, both)):
        np.testing.assert_allclose(mix_by_edges(both + alone, both, fraction), is_left, atol=1e-6)
    high = blob((0.0, 0.0, 3.0), 0.3)  # the box ends there
    assert mix_by_edges(both + high, both, 0.2)[:, :, -1].max() < 0.25 * high.max()
    assert mix_by_edges(both + high, both, 0.2, SIDES)[:, :, -1].max() > 0.5 * high.max()
    nothing = np.zeros_like(both)
    assert not mix_by_edges(nothing, nothing, 0.5).any()


def test_a_loop_ends_where_it_begins(source, tmp_path):
    for number, _ in loop_sequence(source, tmp_path / "loop", 2, 10, 3, npz=True):
        if number == 2:
            break
    assert len(list(loop_sequence(source, tmp_path / "loop", 2, 10, 3, npz=True, resume=True))) == 4
    loop = Sequence.open(tmp_path / "loop")
    assert loop.frames == tuple(range(1, 7))
    assert (loop.provenance[-1]["what"], loop.provenance[-1]["figures"]) == ("loop", {"first": 1, "last": 3})
    np.testing.assert_array_equal(loop.density(4), source.density(5))
    np.testing.assert_array_equal(loop.density(6), source.density(7))
    # the motion from the end to the start takes as long as the overlap and the step into it
    first = seam(read_state(source, 8), read_state(source, 2), 1 / 4, 4 * DT)
    for found, expected in zip(loop.velocity(1).faces, first.velocity.faces, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-6)

    def step(a, b):
        return float(np.linalg.norm(a - b))

    usual = step(source.density(6), source.density(7))
    # from the last frame to the first, and from the seam to what follows it
    assert step(loop.density(6), loop.density(1)) < 2 * usual
    assert step(loop.density(3), loop.density(4)) < 2 * usual
    assert step(source.density(7), source.density(2)) > 2 * usual
