"""Products of matrices take one thread in the engine, whatever the caller lets them take."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from smokelift import Camera, DirectionalLight, Domain, Medium
from smokelift.render import Renderer
from smokelift.render.blas import products_on_one_thread


def threads() -> set[int]:
    """Those of all libraries that are loaded."""
    return {library["num_threads"] for library in ThreadpoolController().select(user_api="blas").info()}


@pytest.fixture(autouse=True)
def two_threads() -> Iterator[None]:
    with threadpool_limits(2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("This NumPy has no OpenBLAS that takes two threads.")
        yield


def test_products_take_one_thread_and_then_as_many_as_before() -> None:
    with products_on_one_thread():
        assert threads() == {1}
        with products_on_one_thread():
            pass
        assert threads() == {1}
    assert threads() == {2}


class Colour:
    """A matrix that notes the threads of its products."""

    __array_ufunc__ = None  # NumPy leaves the product to it

    def __init__(self) -> None:
        self.size, self.seen = 3, []  # type: tuple[int, list[set[int]]]

    @property
    def T(self) -> Colour:  # noqa: N802  as NumPy's
        return self

    def __rmatmul__(self, left: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        self.seen.append(threads())
        channels = 3 if left.shape[-1] == 1 else 1
        return np.ones((*left.shape[:-1], channels), np.float32)


def test_a_picture_and_its_derivative_take_one_thread() -> None:
    renderer = Renderer(
        Camera.look_at((0, -3, 0.5), (0, 0, 0.5), fov_y_degrees=25, size=(8, 8)),
        Domain((-0.5, -0.5, 0), (0.5, 0.5, 1), (4, 4, 4)),
        Medium(),
        (DirectionalLight((0, 0.6, -0.8), (3, 3, 3)),),
        np.zeros(3, np.float32),
    )
    renderer._colour = colour = Colour()  # type: ignore[assignment]
    renderer.image(np.ones((4, 4, 4), np.float32), keep_record=True)
    renderer.gradient(np.ones((8, 8, 3), np.float32))
    assert colour.seen == [{1}, {1}]
    assert threads() == {2}
