"""What is said against a finished run."""

from __future__ import annotations

import pytest

from smokelift.app.shortcomings import shortcomings


@pytest.mark.parametrize(
    ("left", "says"), [(0.2, ()), (0.4, ("may be smoke", "40%")), (0.8, ("Hardly any smoke was fitted", "80%"))]
)
def test_a_fit_that_explains_little_is_said(left: float, says: tuple[str, ...]) -> None:
    """A good fit says nothing, and one frame that is worse than the others neither."""
    errors = ({"relative_error": left}, {"relative_error": left}, {"relative_error": 0.9}, {})
    said = shortcomings([{"hull_share": 0.1, **figures} for figures in errors])
    assert len(said) == bool(says)
    assert all(word in said[0] for word in says)


def test_empty_frames_are_counted() -> None:
    said = shortcomings([{"hull_share": 0.0}, {"hull_share": None}, {}, {"hull_share": 0.2}])
    assert said == ["No smoke is seen in 3 of 4 frames; such frames are empty."]
