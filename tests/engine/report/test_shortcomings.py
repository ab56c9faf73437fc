"""What is said against a finished run."""

from __future__ import annotations

import pytest

from smokelift.checks import Doubt
from smokelift.report.shortcomings import shortcomings


@pytest.mark.parametrize(
    ("left", "kinds"), [(0.2, []), (0.4, ["not all is smoke"]), (0.8, ["hardly any smoke fitted"])]
)
def test_a_fit_that_explains_little_is_said(left: float, kinds: list[str]) -> None:
    """A good fit says nothing, and one frame that is worse than the others neither."""
    errors = ({"relative_error": left}, {"relative_error": left}, {"relative_error": 0.9}, {})
    said = shortcomings([{"hull_share": 0.1, **figures} for figures in errors])
    assert said == [Doubt(kind, {"error": left}) for kind in kinds]


def test_empty_frames_are_counted() -> None:
    said = shortcomings([{"hull_share": 0.0}, {"hull_share": None}, {}, {"hull_share": 0.2}])
    assert said == [Doubt("empty frames", {"empty": 3, "frames": 4})]
