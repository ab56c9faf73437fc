"""Voxels of a grid and of one half as fine, also along an odd number of them."""

from __future__ import annotations

import numpy as np

from smokelift.density.halves import any_of_two, every_second, means_of_two, prolonged, spread_to_two

ODD = (5, 4, 7)


def test_a_mark_is_kept_and_spread_to_its_block() -> None:
    voxels = np.zeros(ODD, np.bool_)
    voxels[4, 1, 6] = voxels[1, 2, 3] = True
    coarse = any_of_two(voxels)
    assert coarse.shape == (3, 2, 4)
    assert sorted(zip(*np.nonzero(coarse), strict=True)) == [(0, 1, 1), (2, 0, 3)]
    block = spread_to_two(coarse, ODD)
    assert block[voxels].all()
    assert np.count_nonzero(block) == 8 + 2
    np.testing.assert_array_equal(np.argwhere(every_second(coarse, ODD)), [[0, 2, 2], [4, 0, 6]])


def test_means_keep_the_sum_and_prolonged_values_their_mean() -> None:
    values = np.random.default_rng(0).random(ODD, np.float32)
    means = means_of_two(values)
    assert np.isclose(8 * means.sum(dtype=np.float64), values.sum(dtype=np.float64))
    np.testing.assert_allclose(prolonged(np.full((3, 2, 4), 2, np.float32)), 2)
    ramp = np.broadcast_to(np.arange(4, dtype=np.float32), (1, 1, 4))
    np.testing.assert_allclose(prolonged(ramp)[0, 0], [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3])
