"""Means over blocks of what is stored of a clip."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.footage.noise import block_means, decode_samples, sample_block_means, whole_blocks


@pytest.mark.parametrize("size", [(20, 35), (23, 41), (3, 40)])
def test_block_means_of_samples_are_those_of_decoded_samples_to_the_bit(size: tuple[int, int]) -> None:
    sample = np.random.default_rng(0).integers(0, 65536, (*size, 3)).astype(np.uint16)
    sample[:10] = 65535  # the largest sums
    assert np.array_equal(sample_block_means(sample), block_means(decode_samples(sample[None]))[0])


def test_a_block_is_known_where_all_of_it_is_seen() -> None:
    seen = np.random.default_rng(0).uniform(size=(4, 23, 31)) < 0.97
    pictures = np.where(seen[..., None], np.float32(0.5), np.float32(np.nan)) * np.ones(3, np.float32)
    assert np.array_equal(whole_blocks(seen), np.isfinite(block_means(pictures)[..., 0]))
    assert 0 < whole_blocks(seen).mean() < 1
