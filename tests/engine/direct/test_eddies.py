"""Small eddies that a smooth velocity gains."""

import numpy as np
import pytest

from smokelift.direct import Moment
from smokelift.direct.eddies import with_small_eddies
from smokelift.direct.turbulence import Turbulence
from smokelift.transport import Velocity, at_centres, divergence, project

SHAPE = (32, 32, 40)
VOXEL = 0.05


def moment(*sizes: float) -> Moment:
    """A block of smoke in eddies of some sizes in voxels, 0.4 m/s each."""
    density = np.zeros(SHAPE, np.float32)
    density[6:26, 6:26, 8:32] = 1
    still = Velocity.zero(SHAPE, VOXEL)
    each = [Turbulence(0.4, size * VOXEL, 9).velocity(still, 0.0) for size in sizes]
    return Moment(density, project(still.with_faces([sum(parts) for parts in zip(*each, strict=True)])))


def energy(moment: Moment, smoke: bool) -> float:
    inside = (moment.density > 0) == smoke
    return sum(float(np.square(u[inside]).mean()) for u in at_centres(moment.velocity.faces))


def test_a_smooth_velocity_gains_eddies_in_the_smoke():
    smooth = moment(16)
    stirred = with_small_eddies(smooth)
    assert energy(stirred, True) > 1.15 * energy(smooth, True)
    far = np.ones(SHAPE, bool)
    far[1:-1, 1:-1, 1:-1] = False
    for before, after in zip(*(at_centres(m.velocity.faces) for m in (smooth, stirred)), strict=True):
        assert np.abs(after - before)[far].mean() < 0.1 * np.abs(before)[far].mean()
    assert np.abs(divergence(stirred.velocity)).max() * VOXEL < 1e-4
    again = with_small_eddies(smooth)
    np.testing.assert_array_equal(again.velocity.faces[0], stirred.velocity.faces[0])


def test_a_velocity_that_has_its_eddies_gains_few():
    full = moment(2.2, 4, 8, 16)
    assert energy(with_small_eddies(full), True) == pytest.approx(energy(full, True), rel=0.25)


def test_still_air_and_narrow_boxes_stay():
    still = Moment(np.ones(SHAPE, np.float32), Velocity.zero(SHAPE, VOXEL))
    assert not any(component.any() for component in with_small_eddies(still).velocity.faces)
    narrow = Moment(np.ones((8, 8, 8), np.float32), Velocity.zero((8, 8, 8), VOXEL))
    assert with_small_eddies(narrow) is narrow
