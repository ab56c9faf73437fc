"""What the tests of directed smoke share."""

import pytest

from smokelift import Sequence
from smokelift.direct.state import open_source
from tests.engine.direct.rising import write_plume


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Sequence:
    """The plume as a sequence that is directed."""
    directory = tmp_path_factory.mktemp("source") / "smoke"
    write_plume(directory)
    return open_source(directory)
