"""The text of scene files. Knows nothing of Blender."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def dumps(tables: Mapping[str, Any]) -> str:
    """The text of a TOML file.

    Parameters
    ----------
    tables
        Tables and lists of tables by name; their values are numbers, texts, or nested lists of those.
    """
    parts = []
    for name, content in tables.items():
        if isinstance(content, list):
            parts += [_table(f"[[{name}]]", table) for table in content]
        else:
            parts.append(_table(f"[{name}]", content))
    return "\n".join(parts)


def _table(header: str, table: Mapping[str, Any]) -> str:
    return "\n".join([header, *(f"{key} = {_value(value)}" for key, value in table.items())]) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML's texts are JSON's but for this
    return repr(value)
