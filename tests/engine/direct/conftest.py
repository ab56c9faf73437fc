"""What the tests of directed smoke share."""

from collections.abc import Iterator

import pytest

from smokelift import Sequence, _core
from smokelift.direct.new_sequence import open_source
from tests.engine.direct.rising import write_plume


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Boxes of a few voxels are computed faster by one thread than shared out."""
    _core.set_threads(1)
    yield
    _core.set_threads(0)


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Sequence:
    """The plume as a sequence that is directed."""
    directory = tmp_path_factory.mktemp("source") / "smoke"
    write_plume(directory)
    return open_source(directory)
