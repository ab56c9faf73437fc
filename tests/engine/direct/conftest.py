"""What the tests of directed smoke share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from smokelift import _core


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Boxes of a few voxels are computed faster by one thread than shared out."""
    _core.set_threads(1)
    yield
    _core.set_threads(0)
