"""Voxels of a grid and of one half as fine, also along an odd number of them."""

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.density.coarser_grid import any_of_two, every_second, spread_to_two, with_neighbours

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
    means = _core.means_of_two(values)
    assert np.isclose(8 * means.sum(dtype=np.float64), values.sum(dtype=np.float64))
    everywhere = np.ones(ODD, np.bool_)
    np.testing.assert_allclose(_core.prolong_values(np.full((3, 2, 4), 2, np.float32), everywhere), 2)
    ramp = np.ascontiguousarray(np.broadcast_to(np.arange(4, dtype=np.float32), (3, 2, 4)))
    fine = _core.prolong_values(ramp, everywhere).reshape(ODD)
    np.testing.assert_allclose(fine[2, 1], [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75])


def test_values_scale_as_coarse_ones_do_where_they_are_marked_alone() -> None:
    values, marks = np.random.default_rng(0).random((2, *ODD), np.float32)
    voxels, result = marks > 0.5, np.zeros(ODD, np.float32)
    before = _core.means_of_two(values)
    x = np.arange(3, dtype=np.float32).reshape(-1, 1, 1)
    _core.scale_alike(values[1:], voxels[1:], before[1:], 3 * before[1:], 1e-30, result[1:])
    np.testing.assert_allclose(result[1:], np.where(voxels, 3 * values, 0)[1:], rtol=1e-6)
    assert not result[0].any()
    _core.scale_alike(values, voxels, np.ones_like(before), np.ones_like(before) * x, 1e-30, result)
    np.testing.assert_allclose(result[2], np.where(voxels, values, 0)[2] * 0.75, rtol=1e-6)


def test_neighbours_are_those_of_a_dilation() -> None:
    voxels = np.random.default_rng(0).random((6, 7, 9)) > 0.95
    np.testing.assert_array_equal(with_neighbours(voxels), ndimage.binary_dilation(voxels))
    everywhere = ndimage.binary_dilation(voxels, np.ones((3, 3, 3)))
    np.testing.assert_array_equal(with_neighbours(voxels, corners=True), everywhere)
