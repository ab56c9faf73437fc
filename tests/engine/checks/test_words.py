"""How messages say numbers and values."""

from __future__ import annotations

import pytest

from smokelift.checks import counted, shown


def test_one_of_something_is_no_plural() -> None:
    assert [counted(number, "frame") for number in (0, 1, 2)] == ["0 frames", "1 frame", "2 frames"]


@pytest.mark.parametrize(
    ("value", "words"),
    [(True, "true"), ((1, 2), "[1, 2]"), ("a\nb", r'"a\nb"'), ("x" * 100, '"' + "x" * 56 + "...")],
)
def test_a_value_is_shown_as_in_a_scene_file(value: object, words: str) -> None:
    assert shown(value) == words
