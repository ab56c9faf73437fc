"""The list of a batch, ``shots.toml``, as ``docs/batch.md`` describes it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smokelift.checks import shown
from smokelift.scene.toml_files import Place, line_of, parse_toml, read_text

OPTIONS = (
    *("quality", "method", "resolution", "scattering", "frames", "mask"),
    *("distance", "detail", "seed", "device", "start_number", "npz"),
)
"""Keys of a shot that are options of ``smokelift reconstruct``."""

_NAME = re.compile(r"[^\W.][^\\/:*?\"<>|\x00-\x1f]*")
"""Names that every file system takes and that are no hidden files."""


@dataclass(frozen=True)
class BatchShot:
    """A clip that is reconstructed.

    The input is a scene file, a video, or a pattern of pictures; the options are those of ``smokelift reconstruct``, as
    on its command line; and the folder holds everything that belongs to the batch.
    """

    name: str
    input: Path
    options: tuple[str, ...]
    folder: Path

    @property
    def directory(self) -> Path:
        """Folder of its sequence."""
        return self.folder / self.name

    def file(self, extension: str) -> Path:
        """A file beside the sequence: a frame of the clip beside its smoke (png), what is known (json), the log."""
        return self.folder / f"{self.name}.{extension}"


class _ListError(ValueError):
    """What is wrong in a list, and in which table or key."""

    def __init__(self, message: str, *place: str | int) -> None:
        super().__init__(message)
        self.place: Place = place


def read_shots(path: Path, check: Callable[[Sequence[str]], None]) -> tuple[BatchShot, ...]:
    """Read a list of shots; `check` raises ValueError for arguments that ``smokelift reconstruct`` does not take.

    It raises ValueError with the file, the line and what was expected, and OSError if the file cannot be read.
    """
    data, lines = parse_toml(read_text(path), path.name)
    try:
        return tuple(_shots(path.absolute().parent, data, check))
    except _ListError as error:
        raise ValueError(f"{path.name}{line_of(error.place, lines)}: {error}") from error


def _shots(base: Path, data: Mapping[str, Any], check: Callable[[Sequence[str]], None]) -> Iterator[BatchShot]:
    _require_known(data, ("out", "defaults", "shots"))
    folder = base / _text(data.get("out", "results"), "out")
    tables, defaults = data.get("shots"), data.get("defaults", {})
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise _ListError("lists no shots; write a table [[shots]] with an input for each")
    if not isinstance(defaults, dict):
        raise _ListError(f"defaults must be a table, not {shown(defaults)}", "defaults")
    _require_known(defaults, OPTIONS, "defaults")
    names = set()
    for place, table in ((("shots", index), table) for index, table in enumerate(tables)):
        _require_known(table, ("name", "input", *OPTIONS), *place)
        if "input" not in table:
            raise _ListError("input is missing", *place)
        source = base / _text(table["input"], *place, "input")
        name = _text(table.get("name", source.stem.rstrip("#_-. ") or "shot"), *place, "name")
        if not _NAME.fullmatch(name):
            raise _ListError(f"{shown(name)} cannot be the name of a file; choose another name", *place, "name")
        if name.casefold() in names:  # some file systems do not tell a from A
            raise _ListError(f"several shots are called {shown(name)}; give each a name", *place)
        names.add(name.casefold())
        chosen = {**defaults, **table}
        options = [word for key in OPTIONS if key in chosen for word in _words(base, chosen[key], *place, key)]
        try:
            check([str(source), "--out", str(folder / name), *options])
        except ValueError as error:
            raise _ListError(str(error), *place) from error
        yield BatchShot(name, source, tuple(options), folder)


def _words(base: Path, value: Any, *place: str | int) -> list[str]:
    """The words of the command line that say an option."""
    key = str(place[-1])
    if key == "npz":
        if not isinstance(value, bool):
            raise _ListError(f"npz must be true or false, not {shown(value)}", *place)
        return ["--npz"] * value
    if key == "mask":
        value = str(base / _text(value, *place))
    between = {"frames": ":", "resolution": ","}.get(key)
    if isinstance(value, list) and between and all(type(part) is int for part in value):
        value = between.join(map(str, value))
    if not isinstance(value, str | int | float) or isinstance(value, bool):
        raise _ListError(f"{key} cannot be {shown(value)}", *place)
    return [f"--{key.replace('_', '-')}={value}"]  # one word, because a number may be negative


def _text(value: Any, *place: str | int) -> str:
    if not isinstance(value, str) or not value:
        raise _ListError(f"{place[-1]} must be a text, not {shown(value)}", *place)
    return value


def _require_known(table: Mapping[str, Any], keys: Sequence[str], *place: str | int) -> None:
    for key in table:
        if key not in keys:
            raise _ListError(f"there is no key {shown(key)} here; known are {', '.join(keys)}", *place, key)
