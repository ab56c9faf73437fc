"""Grids that are half as fine."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.transport import divergence, face_shapes, project
from smokelift.velocity import Velocity
from smokelift.velocity.pyramid import coarsen_faces


@pytest.mark.parametrize("shape", [(8, 6, 10), (7, 9, 5)])
def test_half_as_fine_a_flow_is_as_free_of_divergence(shape):
    """What goes through a coarse face is what went through its four fine ones."""
    rng = np.random.default_rng(0)
    rough = Velocity(tuple(rng.standard_normal(n).astype(np.float32) for n in face_shapes(shape)), 1.0)
    coarse = coarsen_faces(project(rough))
    assert coarse.shape == tuple((n + 1) // 2 for n in shape)
    inner = tuple(slice(0, n // 2) for n in shape)  # an odd last voxel is continued outwards
    assert np.abs(divergence(coarse)[inner]).max() < 1e-5
