"""The directions of the descent."""

import numpy as np

import smokelift._core as _core
from smokelift.checks import Array
from smokelift.density.descent import with_neighbors


def test_neighbors_share_a_step() -> None:
    """What one voxel wants reaches its cube, evenly both ways, and what all want alike stays as it is."""
    shape, random = (9, 7, 8), np.random.default_rng(5)
    where = _core.MarkedVoxels(random.random(shape) < 0.7)
    one, other = random.standard_normal((2, where.count)).astype(np.float32)

    def shared(values: Array) -> Array:
        return with_neighbors(where, values, np.empty_like(values))

    np.testing.assert_allclose(shared(np.ones_like(one)), 1, rtol=1e-6)
    np.testing.assert_allclose(one @ shared(other), shared(one) @ other, rtol=1e-4)
    alone = np.zeros_like(one)
    alone[0] = 1
    assert 1 < np.count_nonzero(shared(alone)) < where.count
