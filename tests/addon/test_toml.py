"""Scene files are TOML that the standard reader understands."""

from __future__ import annotations

import tomllib

from hypothesis import given, settings
from hypothesis import strategies as st

from addon.toml import dumps

TEXTS = st.text(st.characters(exclude_categories=["Cs"]))
NUMBERS = st.integers(-(2**31), 2**31) | st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False)
VALUES = st.recursive(TEXTS | NUMBERS, lambda inner: st.lists(inner, max_size=4), max_leaves=8)
NAMES = st.from_regex(r"[a-z_]{1,8}", fullmatch=True)
TABLES = st.dictionaries(NAMES, VALUES, max_size=4)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.dictionaries(NAMES, TABLES | st.lists(TABLES, min_size=1, max_size=3), max_size=4))
def test_what_is_written_is_read_back(tables) -> None:
    """Any texts (paths with quotes, backslashes, umlauts), numbers and nested lists."""
    assert tomllib.loads(dumps(tables)) == tables
