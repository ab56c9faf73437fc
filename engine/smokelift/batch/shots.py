"""The list of a batch, ``shots.toml``: what is reconstructed, and with which settings.

    out = "results"             # folder of everything that is written; "results" if left out

    [defaults]                  # options of every shot that does not have its own
    quality = "draft"

    [[shots]]
    input = "steam.mp4"         # or a scene file, or frame_####.png
    name = "steam"              # of its files in the folder; the input's name if left out
    frames = [10, 99]

Paths are relative to the file. The options are those of ``smokelift reconstruct``, by the same names.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smokelift.checks import shown
from smokelift.scene.files import read_text
from smokelift.scene.toml_lines import Place, find_lines, line_of

OPTIONS = (
    "quality",
    "method",
    "resolution",
    "scattering",
    "frames",
    "mask",
    "distance",
    "detail",
    "seed",
    "device",
    "start_number",
    "npz",
)
"""Keys of a shot that are options of ``smokelift reconstruct``."""

_NAME = re.compile(r"[^\W.][^\\/:*?\"<>|\x00-\x1f]*")
"""Names that every file system takes and that are no hidden files."""

Check = Callable[[Sequence[str]], None]
"""Raises ValueError for arguments that ``smokelift reconstruct`` does not take."""


@dataclass(frozen=True)
class BatchShot:
    """A clip that is reconstructed.

    Attributes
    ----------
    name
        Of its files.
    input
        A scene file, a video, or a pattern of pictures.
    options
        Of ``smokelift reconstruct``, as on its command line.
    folder
        Where everything is written that belongs to the batch.
    """

    name: str
    input: Path
    options: tuple[str, ...]
    folder: Path

    @property
    def directory(self) -> Path:
        """Folder of its sequence."""
        return self.folder / self.name

    @property
    def picture(self) -> Path:
        """A frame of the clip beside its reconstruction."""
        return self.folder / f"{self.name}.png"

    @property
    def log(self) -> Path:
        """All that its runs said."""
        return self.folder / f"{self.name}.log"


def read_shots(path: Path, check: Check) -> tuple[BatchShot, ...]:
    """Read a list of shots, the arguments of each of which `check` judges.

    It raises ValueError with the file, the line and what was expected, and OSError if the file cannot be read.
    """
    text = read_text(path)
    try:
        data = tomllib.loads(text)
    except (RecursionError, ValueError) as error:
        raise ValueError(f"{path.name}: is not valid TOML: {error}") from error
    return _Reader(path, find_lines(text)).shots(data, check)


@dataclass(frozen=True)
class _Reader:
    path: Path
    lines: Mapping[Place, int]

    def shots(self, data: Mapping[str, Any], check: Check) -> tuple[BatchShot, ...]:
        self._known((), data, ("out", "defaults", "shots"))
        folder = self.path.absolute().parent / self._text((), data, "out", "results")
        tables, defaults = data.get("shots"), data.get("defaults", {})
        if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
            raise self._error((), "lists no shots; write a table [[shots]] with an input for each")
        if not isinstance(defaults, dict):
            raise self._error(("defaults",), f"defaults must be a table, not {shown(defaults)}")
        self._known(("defaults",), defaults, OPTIONS)
        shots = [self._shot(("shots", n), table, defaults, folder, check) for n, table in enumerate(tables)]
        counts = Counter(shot.name.casefold() for shot in shots)  # some file systems do not tell a from A
        for number, shot in enumerate(shots):
            if counts[shot.name.casefold()] > 1:
                raise self._error(("shots", number), f"several shots are called {shown(shot.name)}; give each a name")
        return tuple(shots)

    def _shot(
        self, place: Place, table: Mapping[str, Any], defaults: Mapping[str, Any], folder: Path, check: Check
    ) -> BatchShot:
        self._known(place, table, ("name", "input", *OPTIONS))
        given = Path(self._text(place, table, "input"))
        name = self._text(place, table, "name", given.stem.rstrip("#_-. ") or "shot")
        if not _NAME.fullmatch(name):
            raise self._error((*place, "name"), f"{shown(name)} cannot be the name of a file; choose another name")
        chosen = {**defaults, **table}
        options = [word for key in OPTIONS if key in chosen for word in self._words(place, key, chosen[key])]
        source = self.path.absolute().parent / given
        try:
            check([str(source), "--out", str(folder / name), *options])
        except ValueError as error:
            raise self._error(place, str(error)) from error
        return BatchShot(name, source, tuple(options), folder)

    def _words(self, place: Place, key: str, value: Any) -> list[str]:
        """The words of the command line that say an option."""
        if key == "npz":
            if not isinstance(value, bool):
                raise self._error((*place, key), f"npz must be true or false, not {shown(value)}")
            return ["--npz"] * value
        if key == "mask":
            return [f"--mask={self.path.absolute().parent / self._text(place, {key: value}, key)}"]
        between = {"frames": ":", "resolution": ","}.get(key)
        if isinstance(value, list) and between and all(type(part) is int for part in value):
            value = between.join(map(str, value))
        if not isinstance(value, str | int | float) or isinstance(value, bool):
            raise self._error((*place, key), f"{key} cannot be {shown(value)}")
        return [f"--{key.replace('_', '-')}={value}"]  # one word, because a number may be negative

    def _text(self, place: Place, table: Mapping[str, Any], key: str, default: str | None = None) -> str:
        value = table.get(key, default)
        if value is None:
            raise self._error(place, f"{key} is missing")
        if not isinstance(value, str) or not value:
            raise self._error((*place, key), f"{key} must be a text, not {shown(value)}")
        return value

    def _known(self, place: Place, table: Mapping[str, Any], keys: Sequence[str]) -> None:
        for key in table:
            if key not in keys:
                raise self._error((*place, key), f"there is no key {shown(key)} here; known are {', '.join(keys)}")

    def _error(self, place: Place, message: str) -> ValueError:
        return ValueError(f"{self.path.name}{line_of(place, self.lines)}: {message}")
