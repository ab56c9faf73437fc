"""TOML files that a user names, with the lines on which their tables and keys stand."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from smokelift.checks import listed, printable, shown
from smokelift.checks.whole_files import atomic_path, read_text
from smokelift.scene.checks import SceneError

Place = tuple[str | int, ...]
"""Names of nested tables and a key, with the index of a table in a list of them: ``("lights", 1, "direction")``."""

_HEADER = re.compile(r"\s*(\[\[?)\s*([\w\-.\"' ]+?)\s*\]")
_KEY = re.compile(r"\s*([\w\-.\"' ]+?)\s*=")


@dataclass(frozen=True)
class TomlFile:
    """What messages say of a TOML file: its name, and the line of each place. Paths in it are relative to ``base``."""

    name: str
    base: Path
    lines: Mapping[Place, int]

    def error(self, place: Place, message: str, key: str = "") -> SceneError:
        """Return an error that names the file, the line of the key (or of its table) and the table."""
        stands: Place = (*place, key) if key else place
        while stands and stands not in self.lines:
            stands = stands[:-1]
        line = f", line {self.lines[stands]}" if stands else ""
        header = ".".join(part for part in place if isinstance(part, str))
        if place:
            header = f"[[{header}]] " if isinstance(place[-1], int) else f"[{header}] "
        return SceneError(f"{self.name}{line}: {header}{message}", key=key, table=".".join(map(str, place)))

    def require_known(self, place: Place, table: Mapping[str, Any], keys: tuple[str, ...]) -> None:
        """Refuse a key that a table does not have."""
        for key in table:
            if key not in keys:
                what, known = "key" if place else "table", ", ".join(keys)
                raise self.error(place, f"there is no {what} {shown(key)} here; known are {known}", key)


def read_toml(path: Path) -> tuple[dict[str, Any], TomlFile]:
    """Read a TOML file; SceneError with the path if it cannot be read or is none."""
    try:
        text = read_text(path)
    except (OSError, ValueError) as error:
        raise SceneError(str(error)) from error
    try:
        return tomllib.loads(text), TomlFile(path.name, path.absolute().parent, _find_lines(text))
    except RecursionError as error:
        raise SceneError(f"{path.name}: is not valid TOML: lists or tables are nested too deeply") from error
    except ValueError as error:  # an integer of 5000 digits is no error of TOML's
        advice = "; write a path with / or between single quotes" if "\\" in text else ""
        raise SceneError(f"{path.name}: is not valid TOML: {error}{advice}") from error


def write_toml(path: Path, data: Mapping[str, Any], comments: Sequence[str] = ()) -> None:
    """Write a TOML file, whole or not at all, with comments as lines at its top; SceneError if that is a folder."""
    if path.is_dir():
        raise SceneError(f"{path}: is a folder; give the name of a file")
    top = "".join(f"# {printable(line)}\n" for line in listed(comments, str, "comments", "a list of lines"))
    with atomic_path(path) as aside:
        aside.write_text(top + tomli_w.dumps(data), encoding="utf-8")


def _find_lines(text: str) -> dict[Place, int]:
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


def _names(dotted: str) -> list[str]:
    return [part.strip().strip("\"'") for part in dotted.split(".")]
