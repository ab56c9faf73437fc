"""Staggered grids: what they hold, and what is refused."""

import numpy as np
import pytest

from smokelift import _core
from smokelift.transport import Velocity, advect, project
from tests.engine.transport.random_fields import SHAPE, random_velocity, uniform


def test_centers_are_means_of_faces():
    velocity = uniform((1, 2, 3))
    np.testing.assert_array_equal(velocity.centres(), np.broadcast_to(np.float32([1, 2, 3]), (*SHAPE, 3)))
    assert velocity.shape == SHAPE
    x, y, z = random_velocity(0).faces
    expected = np.stack([x[1:] + x[:-1], y[:, 1:] + y[:, :-1], z[:, :, 1:] + z[:, :, :-1]], -1) / 2
    np.testing.assert_array_equal(random_velocity(0).centres(), expected)


def test_bad_input_is_refused():
    velocity = Velocity.zero(SHAPE, 1.0)
    density = np.zeros(SHAPE, np.float32)
    with pytest.raises(ValueError, match="shape"):
        advect(density[1:], velocity, 1.0)
    for dt in (0.0, 1e300):
        with pytest.raises(ValueError, match="dt must be positive and finite, from 1e-09"):
            advect(density, velocity, dt)
    for carried in (density, velocity):
        with pytest.raises(ValueError, match=r"moves smoke by more than 1e\+09 voxels in 1 s"):
            advect(carried, uniform((-3e38,) * 3), 1)
    with pytest.raises(ValueError, match="unknown scheme"):
        advect(density, velocity, 1.0, scheme="cubic")
    with pytest.raises(ValueError, match="not finite"):
        advect(density + np.nan, velocity, 1.0)
    with pytest.raises(ValueError, match="not for negative values"):
        advect(density - 1, velocity, 1.0, conserve=True)
    with pytest.raises(ValueError, match="not for a velocity"):
        advect(velocity, velocity, 1.0, conserve=True)
    with pytest.raises(ValueError, match="closed must be a list of sides"):
        project(velocity, ("up",))
    for size in (0.0, 1e-44):
        with pytest.raises(ValueError, match="voxel_size must be positive and finite, from 1e-09"):
            Velocity.zero(SHAPE, size)
    with pytest.raises(ValueError, match="do not belong to one box"):
        Velocity((density, density, density), 1.0)
    with pytest.raises(ValueError, match="not finite"):
        Velocity(tuple(a + np.nan for a in velocity.faces), 1.0)
    with pytest.raises(ValueError, match="not have shapes"):
        _core.divergence([density, density, density])
