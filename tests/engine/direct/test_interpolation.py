"""Smoke between two moments, and sequences at another pace."""

import numpy as np
import pytest

from smokelift.direct import Moment, open_source, playback, retime_sequence
from smokelift.direct.interpolation import interpolate
from smokelift.output.sequence import Sequence
from smokelift.transport import Velocity
from tests.engine.direct.rising import DOMAIN, DT, at_rest, blob, write_plume


def moving(speed: float) -> Velocity:
    """Everything goes along x."""
    x, y, z = Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size, ("z-",)).faces
    return Velocity((x + np.float32(speed), y, z), DOMAIN.voxel_size, ("z-",))


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_interpolation_moves_a_blob_and_does_not_blend_two(share):
    way = 2 * DOMAIN.voxel_size
    velocity = moving(way / DT)
    first, last = Moment(blob((-0.2, 0, 1)), velocity), Moment(blob((-0.2 + way, 0, 1)), velocity)
    true = blob((-0.2 + share * way, 0, 1))
    found = interpolate(first, last, velocity, DT, share)
    mixed = (1 - share) * first.density + share * last.density

    def error(density):
        return float(np.linalg.norm(density - true) / np.linalg.norm(true))

    assert error(found.density) < 0.05
    assert error(found.density) < 0.2 * error(mixed)
    assert found.density.sum() == pytest.approx(true.sum(), rel=2e-3)
    np.testing.assert_allclose(found.velocity.faces[0][4:12], velocity.faces[0][4:12], rtol=1e-3)


def test_mass_goes_evenly_from_one_moment_to_the_other():
    still = moving(0.0)
    first, last = at_rest(blob()), at_rest(3 * blob())
    found = interpolate(first, last, still, DT, 0.25)
    assert found.density.sum() == pytest.approx(1.5 * first.density.sum(), rel=1e-4)


def test_a_pace_shows_every_moment_once():
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


def test_a_sequence_at_half_its_speed(tmp_path):
    write_plume(tmp_path / "smoke", 5)
    source = open_source(tmp_path / "smoke")
    for number, _ in retime_sequence(source, tmp_path / "slow", (0.5,), npz=True):
        if number == 3:
            break
    assert len(list(retime_sequence(source, tmp_path / "slow", (0.5,), npz=True, resume=True))) == 6
    slow = Sequence.open(tmp_path / "slow")
    assert slow.frames == tuple(range(1, 10))
    for number in source.frames:
        np.testing.assert_allclose(slow.density(2 * number - 1), source.density(number), rtol=1e-6)
        found, known = slow.velocity(2 * number - 1), source.velocity(number)
        np.testing.assert_allclose(found.centres(), 0.5 * known.centres(), atol=1e-5)
    masses = [slow.figures(number)["mass"] for number in (3, 4, 5)]
    assert masses[1] == pytest.approx((masses[0] + masses[2]) / 2, rel=0.02)
    assert max(slow.figures(number)["divergence"] for number in slow.frames) < 1e-3


def test_a_flame_is_carried_as_the_smoke_is():
    way = 2 * DOMAIN.voxel_size
    velocity = moving(way / DT)
    first, last = (Moment(blob((x, 0, 1)), velocity, 3 * blob((x, 0, 1))) for x in (-0.2, -0.2 + way))
    found = interpolate(first, last, velocity, DT, 0.5)
    np.testing.assert_allclose(found.flame, 3 * found.density, rtol=1e-4, atol=1e-5)
    assert interpolate(first, Moment(last.density, velocity), velocity, DT, 0.5).flame is None
