"""Pictures as they are stored, beside the same ones in linear light."""

import numpy as np
import pytest

from smokelift.footage.images import area_average, code_values, linear_to_srgb
from smokelift.footage.stored_picture import StoredPicture, chequered_averages


@pytest.mark.parametrize("size", [(7, 5), (31, 40), (64, 48), (80, 40)])
def test_averages_of_codes_are_those_of_the_linear_picture_to_the_last_bit(size: tuple[int, int]) -> None:
    random = np.random.default_rng(0)
    for dtype in (np.uint8, np.uint16):
        top = np.iinfo(dtype).max
        picture = StoredPicture(random.integers(0, top, (48, 64, 3), dtype, endpoint=True), code_values(top))
        for part in (np.s_[:], np.s_[3:41, 5:60]):
            some = picture.cut(lambda pixels, part=part: pixels[part])
            assert np.array_equal(some.averaged(*size), area_average(picture.linear()[part], *size))
    with pytest.raises(ValueError, match="at least one pixel"):
        picture.averaged(4, 0)


@pytest.mark.parametrize("size", [(7, 5), (31, 40), (64, 48), (80, 60)])
@pytest.mark.parametrize("first", [0, 1])
def test_averages_of_a_chequerboard_are_those_of_its_pixels_to_the_last_bit(size: tuple[int, int], first: int) -> None:
    random = np.random.default_rng(0)
    rows, columns = np.indices((48, 64))
    for dtype in (np.uint8, np.uint16):
        top = np.iinfo(dtype).max
        picture = StoredPicture(random.integers(0, top, (48, 64, 3), dtype, endpoint=True), code_values(top))
        linear = picture.linear()
        for colour in (0, 1):
            share = ((rows + columns) % 2 == (first + colour) % 2).astype(np.float32)
            weight = np.maximum(area_average(share, *size), np.float32(1e-6))
            expected = area_average(linear * share[..., None], *size) / weight[..., None]
            for image in (picture, StoredPicture(linear)):
                assert np.array_equal(chequered_averages(image, *size, first)[colour], expected)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_codes_are_added_as_the_linear_picture_to_the_last_bit(dtype: type) -> None:
    random, top = np.random.default_rng(0), np.iinfo(dtype).max
    picture = StoredPicture(random.integers(0, top, (20, 36, 3), dtype, endpoint=True), code_values(top))
    edges = np.array([0, 3, 3, 20], np.int32), np.array([0, 1, 18, 30, 36], np.int32)
    weights, sums = random.random((3, 4, 3), np.float32), random.random((20, 36, 3), np.float32)
    lines, columns = (np.diff(each) for each in edges)
    expected = sums + picture.linear() * np.repeat(np.repeat(weights, lines, axis=0), columns, axis=1)
    others = sums.copy()
    picture.add_weighted(weights, edges, sums)
    StoredPicture(picture.linear()).add_weighted(weights, edges, others)
    assert np.array_equal(sums, expected)
    assert np.array_equal(others, expected)


def test_both_kinds_are_read_alike() -> None:
    coded = StoredPicture(np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8), code_values(255))
    linear = StoredPicture(coded.linear())
    assert coded.size == linear.size == (8, 6)
    for picture in (coded, linear):
        assert np.array_equal(picture.through(linear_to_srgb), linear_to_srgb(coded.linear()))
