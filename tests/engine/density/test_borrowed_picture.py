"""Borrowed pictures: the rows' amounts, middles and widths of one picture, the detail of another."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from smokelift.density.borrowed_picture import borrowed_picture, matching_rows

ROWS, COLUMNS = 40, 32


def spindle(middle: float = 16.0, width: float = 5.0, first: int = 6, last: int = 34) -> np.ndarray:
    """Smoke without detail: the same bell in every row between two."""
    picture = np.zeros((ROWS, COLUMNS))
    picture[first:last] = np.exp(-(((np.arange(COLUMNS) - middle) / width) ** 2) / 2)
    return ndimage.gaussian_filter(picture, (1.5, 0))


def detailed(seed: int = 0, **shape: float) -> np.ndarray:
    """The spindle times a pattern as fine as two pixels."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(ROWS, COLUMNS)), 1.2)
    return spindle(**shape) * np.maximum(1 + 2.5 * noise, 0)


def fine(picture: np.ndarray) -> np.ndarray:
    """What a blur takes away."""
    return picture - ndimage.gaussian_filter(picture, 3)


def alike(a: np.ndarray, b: np.ndarray) -> float:
    """Correlation of two pictures' detail."""
    return float(np.corrcoef(fine(a).ravel(), fine(b).ravel())[0, 1])


def test_every_row_keeps_its_amount() -> None:
    """Where the smooth answer has smoke."""
    smooth = spindle()
    found = borrowed_picture(smooth, [(1.0, detailed())])
    assert found is not None
    np.testing.assert_allclose(found.sum(1), smooth.sum(1), rtol=1e-6, atol=1e-9)
    assert found.min() >= 0


def test_the_detail_is_the_other_moments() -> None:
    """And not that of a third."""
    found = borrowed_picture(spindle(), [(1.0, detailed(0))])
    assert found is not None
    assert alike(found, detailed(0)) > 0.7
    assert abs(alike(found, detailed(1))) < 0.35


def test_the_other_moment_is_moved_and_stretched_to_where_the_smoke_is() -> None:
    """Its middle, its width and its ends are the smooth answer's."""
    smooth = spindle(middle=20.0, width=3.0, first=12, last=30)
    found = borrowed_picture(smooth, [(1.0, detailed(2, middle=12.0, width=6.0))])
    assert found is not None
    columns = np.arange(COLUMNS)

    def mean_and_width(picture: np.ndarray) -> tuple[float, float]:
        across = picture.sum(0) / picture.sum()
        mean = float(across @ columns)
        return mean, float(np.sqrt(across @ (columns - mean) ** 2))

    mean, width = mean_and_width(found)
    assert mean == pytest.approx(20.0, abs=0.6)
    assert width == pytest.approx(mean_and_width(smooth)[1], rel=0.25)


def test_a_dissolve_is_as_detailed_as_either_end() -> None:
    """The mean of two unlike pictures is fainter; that is made up for."""
    whole = [borrowed_picture(spindle(), [(1.0, detailed(seed))]) for seed in (0, 1)]
    half = borrowed_picture(spindle(), [(0.5, detailed(0)), (0.5, detailed(1))])
    assert half is not None and whole[0] is not None and whole[1] is not None
    power = [float(np.sum(fine(picture) ** 2)) for picture in (*whole, half)]
    assert power[2] == pytest.approx((power[0] + power[1]) / 2, rel=0.35)


def test_a_dissolve_of_a_picture_into_itself_is_that_picture() -> None:
    """Nothing is lost by their mean, so that nothing is made up for: smoke at rest stays as it is."""
    whole = borrowed_picture(spindle(), [(1.0, detailed())])
    half = borrowed_picture(spindle(), [(0.5, detailed()), (0.5, detailed())])
    assert whole is not None and half is not None
    np.testing.assert_allclose(half, whole, rtol=1e-6, atol=1e-9)


def test_without_smoke_nothing_is_borrowed() -> None:
    """Neither for an empty side nor from an empty moment; an empty one beside another does not count."""
    assert borrowed_picture(np.zeros((ROWS, COLUMNS)), [(1.0, detailed())]) is None
    assert borrowed_picture(spindle(), [(1.0, np.zeros((ROWS, COLUMNS)))]) is None
    both = borrowed_picture(spindle(), [(0.5, detailed()), (0.5, np.zeros((ROWS, COLUMNS)))])
    alone = borrowed_picture(spindle(), [(1.0, detailed())])
    np.testing.assert_array_equal(both, alone)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    first=st.integers(2, 10),
    last=st.integers(24, 37),
    other_first=st.integers(2, 10),
    other_last=st.integers(24, 37),
)
def test_smoke_begins_and_ends_in_rows_that_belong_together(first, last, other_first, other_last) -> None:
    """In even steps."""
    amounts, others = np.zeros(ROWS), np.zeros(ROWS)
    amounts[first:last] = 1
    others[other_first:other_last] = 1
    rows = matching_rows(amounts, others)
    assert rows[first] == pytest.approx(other_first, abs=2.5)
    assert rows[last - 1] == pytest.approx(other_last - 1, abs=2.5)
    np.testing.assert_allclose(np.diff(rows, 2), 0, atol=1e-9)
