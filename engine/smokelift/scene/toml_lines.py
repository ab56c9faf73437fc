"""The lines of a TOML file on which its tables and keys stand; the standard reader gives values without them."""

from __future__ import annotations

import re
from collections.abc import Mapping

Place = tuple[str | int, ...]
"""Names of nested tables and a key, with the index of a table in a list of them: ``("lights", 1, "direction")``."""

_HEADER = re.compile(r"\s*(\[\[?)\s*([\w\-.\"' ]+?)\s*\]")
_KEY = re.compile(r"\s*([\w\-.\"' ]+?)\s*=")


def find_lines(text: str) -> dict[Place, int]:
    """Return the line (from 1) of every table and key in valid TOML.

    A key of the second [[lights]] table is found under ``("lights", 1, "direction")``. Keys inside inline
    tables are not listed; their table is. Multi-line strings, which no scene needs, are not understood.
    """
    lines: dict[Place, int] = {}
    counts: dict[Place, int] = {}
    table: Place = ()
    depth = 0
    for index, line in enumerate(text.splitlines(), 1):
        if depth == 0:
            if header := _HEADER.match(line):
                table = ()
                names = _names(header[2])
                for position, part in enumerate(names):
                    table = (*table, part)
                    lines.setdefault(table, index)
                    if header[1] == "[[" and position == len(names) - 1:
                        counts[table] = counts.get(table, -1) + 1
                    if table in counts:
                        table = (*table, counts[table])
                        lines.setdefault(table, index)
                continue
            if key := _KEY.match(line):
                place = table
                for part in _names(key[1]):
                    place = (*place, part)
                    lines.setdefault(place, index)
        bare = re.sub(r'"(\\.|[^"\\])*"|\'[^\']*\'|#.*', "", line)
        depth += bare.count("[") + bare.count("{") - bare.count("]") - bare.count("}")
    return lines


def line_of(place: Place, lines: Mapping[Place, int]) -> str:
    """Return ", line 12" for a key or, where that has no line, for its table; nothing without either."""
    while place and place not in lines:
        place = place[:-1]
    return f", line {lines[place]}" if place else ""


def _names(dotted: str) -> list[str]:
    return [part.strip().strip("\"'") for part in dotted.split(".")]
