"""What the tests of the benchmarks share."""

from tests.engine.conftest import on_the_processor  # noqa: F401, a fixture
