"""What the renderer takes of the machine: memory that begins where large pages do, and one thread of BLAS."""

import sys
from collections.abc import Iterator

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from smokelift import _core
from smokelift.render.device import products_on_one_thread

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


def threads() -> set[int]:
    """Those of all libraries that are loaded."""
    return {library["num_threads"] for library in ThreadpoolController().select(user_api="blas").info()}


@pytest.fixture
def two_threads() -> Iterator[None]:
    with threadpool_limits(2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("This NumPy has no OpenBLAS that takes two threads.")
        yield


def test_products_take_one_thread_and_then_as_many_as_before(two_threads) -> None:
    with products_on_one_thread():
        assert threads() == {1}
        with products_on_one_thread():
            pass
        assert threads() == {1}
    assert threads() == {2}
