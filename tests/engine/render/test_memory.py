"""Memory for the renderer's arrays: where it begins decides whether the system can give large pages."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from smokelift import _core

LARGE_PAGE = 1 << 21


@pytest.mark.parametrize("shape", [(1, 1, 1, 1), (66, 66, 98, 1), (66, 66, 98, 2)])
def test_zeros_are_zero(shape):
    array = _core.zeros(shape)
    assert array.shape == shape
    assert array.dtype == np.float32
    assert not array.any()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux is asked for large pages")
@pytest.mark.parametrize("size", [LARGE_PAGE, LARGE_PAGE + 4, 3 * LARGE_PAGE])
def test_arrays_from_one_large_page_on_begin_at_its_boundary(size):
    arrays = [_core.zeros((size // 4,)) for _ in range(4)]
    assert [array.ctypes.data % LARGE_PAGE for array in arrays] == [0, 0, 0, 0]
