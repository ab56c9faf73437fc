"""Grids that are half as fine."""

import numpy as np
import pytest

from smokelift.transport import divergence, face_shapes, project
from smokelift.velocity import Velocity
from smokelift.velocity.pyramid import coarsen_velocity, prolong
from tests.engine.transport.random_fields import random_velocity


@pytest.mark.parametrize("shape", [(8, 6, 10), (7, 9, 5)])
def test_half_as_fine_a_flow_is_as_free_of_divergence(shape):
    coarse = coarsen_velocity(project(random_velocity(0, shape=shape)))
    assert coarse.shape == tuple((n + 1) // 2 for n in shape)
    inner = tuple(slice(0, n // 2) for n in shape)  # an odd last voxel is continued outwards
    assert np.abs(divergence(coarse)[inner]).max() < 1e-5


@pytest.mark.parametrize("closed", [(), ("z-",), ("x+", "y-", "z+")])
@pytest.mark.parametrize("shape", [(12, 8, 10), (11, 9, 7)])
def test_twice_as_fine_a_flow_has_no_divergence_and_stops_at_walls(shape, closed):
    rough = random_velocity(1, voxel_size=2.0, shape=tuple((n + 1) // 2 for n in shape))
    fine = Velocity(prolong(project(rough, closed), shape), 1.0, closed)
    assert fine.shape == shape
    assert np.abs(divergence(fine)).max() < 1e-5
    for wall in closed:
        axis, end = "xyz".index(wall[0]), -1 if wall[1] == "+" else 0
        assert not fine.faces[axis].take(end, axis).any()


def test_twice_as_fine_a_turning_flow_turns_as_it_did():
    def turning(voxel: float, shape: tuple[int, int, int]) -> Velocity:
        x, y = (voxel * (np.arange(n) + 0.5) for n in shape[:2])
        faces = (y[None, :, None], -x[:, None, None], np.zeros((1, 1, 1)))
        return Velocity(tuple(map(np.broadcast_to, faces, face_shapes(shape))), voxel)

    fine = turning(1.0, (14, 12, 10))
    inner = slice(4, 6)  # the ends are continued
    for found, expected in zip(prolong(turning(2.0, (7, 6, 5)), fine.shape), fine.faces, strict=True):
        np.testing.assert_allclose(found[inner, inner, inner], expected[inner, inner, inner], atol=1e-5)
