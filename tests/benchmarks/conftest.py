"""What the tests of the benchmarks share."""

import pytest

from smokelift.render import device


@pytest.fixture(scope="session", autouse=True)
def on_the_processor() -> None:
    """One device for all tests of a process, whatever their order and whatever GPU is there."""
    device.start("cpu")
