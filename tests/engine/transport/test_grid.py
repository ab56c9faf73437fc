"""Staggered grids: what they hold, and what is refused."""

import numpy as np
import pytest

from smokelift import Velocity, _core, advect, project
from tests.engine.transport.random_fields import SHAPE, random_velocity, uniform


def test_centers_are_means_of_faces():
    velocity = uniform((1, 2, 3))
    np.testing.assert_array_equal(velocity.centres(), np.broadcast_to(np.float32([1, 2, 3]), (*SHAPE, 3)))
    assert velocity.shape == SHAPE
    x, y, z = random_velocity(0).faces
    expected = np.stack([x[1:] + x[:-1], y[:, 1:] + y[:, :-1], z[:, :, 1:] + z[:, :, :-1]], -1) / 2
    np.testing.assert_array_equal(random_velocity(0).centres(), expected)


DENSITY, STILL = np.zeros(SHAPE, np.float32), Velocity.zero(SHAPE, 1.0)
FAST = uniform((-3e38,) * 3)


@pytest.mark.parametrize(
    "call",
    [
        *(lambda dt=dt: advect(DENSITY, STILL, dt) for dt in (0.0, 1e300)),
        *(lambda field=field: advect(field, FAST, 1) for field in (DENSITY, STILL)),
        lambda: advect(DENSITY, STILL, 1.0, scheme="cubic"),
        lambda: advect(DENSITY - 1, STILL, 1.0, conserve=True),
        lambda: advect(STILL, STILL, 1.0, conserve=True),
        lambda: project(STILL, ("up",)),
        *(lambda size=size: Velocity.zero(SHAPE, size) for size in (0.0, 1e-44)),
        lambda: Velocity((DENSITY, DENSITY, DENSITY), 1.0),
        lambda: Velocity(tuple(a + np.nan for a in STILL.faces), 1.0),
        lambda: _core.divergence([DENSITY, DENSITY, DENSITY]),
    ],
)
def test_bad_input_is_refused(call):
    with pytest.raises(ValueError):
        call()
