"""Loops: what they keep, and their seam."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.direct import Moment, loop_sequence, open_source
from smokelift.direct.looping import seam
from smokelift.output.sequence import Sequence
from smokelift.transport import Velocity
from tests.engine.direct.rising import DOMAIN, DT, blob, plume, write_plume


def test_a_seam_moves_a_shape_instead_of_fading_it():
    """Half way there is one blob half way, and the velocity says that it goes there."""
    way = 4 * DOMAIN.voxel_size
    still = Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size, ("z-",))
    end, start = (Moment(blob((x, 0, 1), 0.25), still) for x in (-way / 2, way / 2))
    found = seam(end, start, 0.5, 12 * DT)
    true = blob((0, 0, 1), 0.25)
    faded = (end.density + start.density) / 2
    error, of_fading = (np.linalg.norm(d - true) / np.linalg.norm(true) for d in (found.density, faded))
    assert error < 0.6 * of_fading
    assert found.density.sum() == pytest.approx(true.sum(), rel=0.02)
    speed = (found.velocity.centres()[..., 0] * true).sum() / true.sum()
    assert speed == pytest.approx(way / (12 * DT), rel=0.3)


def test_without_smoke_there_is_nothing_to_carry():
    empty = Moment(np.zeros(DOMAIN.shape, np.float32), plume()[0].velocity)
    found = seam(empty, plume()[0], 0.5, DT)
    np.testing.assert_allclose(found.density, plume()[0].density / 2, atol=1e-6)


def test_a_loop_ends_where_it_begins(tmp_path):
    write_plume(tmp_path / "smoke", 10)
    source = open_source(tmp_path / "smoke")
    for number, _ in loop_sequence(source, tmp_path / "loop", 2, 10, 3, npz=True):
        if number == 2:
            break
    assert len(list(loop_sequence(source, tmp_path / "loop", 2, 10, 3, npz=True, resume=True))) == 4
    loop = Sequence.open(tmp_path / "loop")
    assert loop.frames == tuple(range(1, 7))
    np.testing.assert_array_equal(loop.density(4), source.density(5))
    np.testing.assert_array_equal(loop.density(6), source.density(7))

    def step(a, b):
        return float(np.linalg.norm(a - b))

    usual = step(source.density(6), source.density(7))
    # from the last frame to the first, and from the seam to what follows it
    assert step(loop.density(6), loop.density(1)) < 2 * usual
    assert step(loop.density(3), loop.density(4)) < 2 * usual
    assert step(source.density(7), source.density(2)) > 2 * usual


@pytest.mark.parametrize(("first", "last", "overlap"), [(0, 10, 3), (2, 11, 3), (2, 10, 0), (2, 10, 5), (4, 6, 1)])
def test_loops_that_cannot_be_are_refused(tmp_path, first, last, overlap):
    write_plume(tmp_path / "smoke", 10)
    with pytest.raises(ValueError, match="has the frames 1 to 10"):
        list(loop_sequence(open_source(tmp_path / "smoke"), tmp_path / "out", first, last, overlap, npz=True))
    assert not (tmp_path / "out").exists()
