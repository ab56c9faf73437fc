"""The box and the places where smoke enters."""

from __future__ import annotations

import math

import numpy as np
import pytest

from smokelift.scene import Domain, Inlet
from smokelift.scene.domain import box_around


def test_domain_helpers() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    assert domain.centre == (0.0, 0.0, 1.5)
    assert domain.shape == (64, 64, 96)
    assert domain.voxel_size == 1 / 32


def test_an_inlet_is_the_voxels_in_its_ball() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    inlet = Inlet((0.1, -0.2, 0), 0.4)
    found = inlet.voxels(domain)
    centres = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in found.shape), indexing="ij"), -1) / 32 + domain.min
    np.testing.assert_array_equal(found, np.linalg.norm(centres - inlet.centre, axis=-1) <= 0.4)
    assert found.sum() / 32**3 == pytest.approx(2 / 3 * math.pi * 0.4**3, rel=0.02)


@pytest.mark.parametrize(
    ("centre", "voxel"), [((0.01, 0.02, 0.05), (32, 32, 1)), ((-1.005, 0.99, 3), (0, 63, 95))], ids=["in", "beside"]
)
def test_a_small_inlet_is_the_nearest_voxel(centre, voxel) -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    np.testing.assert_array_equal(np.argwhere(Inlet(centre, 0.006).voxels(domain)), [voxel])


def test_the_box_around_marked_voxels_ends_at_the_grid() -> None:
    marked = np.zeros((9, 8, 7), np.bool_)
    assert all(marked[box_around(marked, 2)].shape[axis] == 0 for axis in range(3))
    marked[4, 1, 6] = marked[5, 3, 5] = True
    assert box_around(marked, 0) == (slice(4, 6), slice(1, 4), slice(5, 7))
    assert box_around(marked, 2) == (slice(2, 8), slice(0, 6), slice(3, 7))
