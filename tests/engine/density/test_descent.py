"""The directions of the descent."""

import numpy as np

from smokelift.density.descent import _Neighbours


def test_neighbours_share_a_step() -> None:
    """What one voxel wants reaches its cube, evenly both ways, and what all want alike stays as it is."""
    shape, random = (9, 7, 8), np.random.default_rng(5)
    where = np.flatnonzero(random.random(shape) < 0.7)
    neighbours = _Neighbours(where, shape)
    one, other = random.standard_normal((2, where.size)).astype(np.float32)
    np.testing.assert_allclose(neighbours.shared(np.ones_like(one)), 1, rtol=1e-6)
    np.testing.assert_allclose(one @ neighbours.shared(other), neighbours.shared(one) @ other, rtol=1e-4)
    alone = np.zeros_like(one)
    alone[0] = 1
    assert 1 < np.count_nonzero(neighbours.shared(alone)) < where.size
