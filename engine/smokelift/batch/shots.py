"""What is known of a batch: its list, ``shots.toml`` (see ``docs/batch.md``), and the record of each shot."""

import argparse
import json
import re
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from smokelift.checks import shown
from smokelift.checks.whole_files import write_text
from smokelift.output.index import Index, SequenceError
from smokelift.scene.scene_file import Place, TomlFile, read_toml

OPTIONS = (
    *("quality", "method", "resolution", "scattering", "frames", "mask"),
    *("distance", "detail", "seed", "device", "start_number", "npz"),
)
"""Keys of a shot that are options of ``smokelift reconstruct``."""

_NAME = re.compile(r"[^\W.][^\\/:*?\"<>|\x00-\x1f]*")
"""Names that every file system takes and that are no hidden files."""

Status = Literal["waiting", "running", "done", "refused", "crashed", "stuck", "cancelled"]
"""``running``: or its machine was lost while it ran; ``refused``: the engine says what is wrong; ``stuck``: what passes
(a full disk, say) did not pass in time."""


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


def read_shots(path: Path, parser: argparse.ArgumentParser) -> tuple[BatchShot, ...]:
    """Read a list of shots, with options that the parser of ``smokelift reconstruct`` takes.

    It raises SceneError with the file, the line and what was expected.
    """
    data, file = read_toml(path)
    file.require_known((), data, ("out", "defaults", "shots"))
    folder = file.base / _text(file, (), "out", data.get("out", "results"))
    tables, defaults = data.get("shots"), data.get("defaults", {})
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise file.error((), "lists no shots; write a table [[shots]] with an input for each")
    if not isinstance(defaults, dict):
        raise file.error((), f"defaults must be a table, not {shown(defaults)}", "defaults")
    file.require_known(("defaults",), defaults, OPTIONS)
    shots: dict[str, BatchShot] = {}
    for index, table in enumerate(tables):
        place = "shots", index
        file.require_known(place, table, ("name", "input", *OPTIONS))
        if "input" not in table:
            raise file.error(place, "lacks input")
        source = file.base / _text(file, place, "input", table["input"])
        name = _text(file, place, "name", table.get("name", source.stem.rstrip("#_-. ") or "shot"))
        if not _NAME.fullmatch(name):
            raise file.error(place, f"{shown(name)} cannot be the name of a file; choose another name", "name")
        if name.casefold() in shots:  # some file systems do not tell a from A
            raise file.error(place, f"several shots are called {shown(name)}; give each a name")
        chosen = {**defaults, **table}
        words = [word for key in OPTIONS if key in chosen for word in _words(file, place, key, chosen[key])]
        try:
            parser.parse_args([str(source), "--out", str(folder / name), *words])
        except argparse.ArgumentError as error:
            raise file.error(place, str(error)) from error
        shots[name.casefold()] = BatchShot(name, source, tuple(words), folder)
    return tuple(shots.values())


def _words(file: TomlFile, place: Place, key: str, value: Any) -> list[str]:
    if key == "npz" and isinstance(value, bool):
        return ["--npz"] * value
    if key == "mask":
        value = str(file.base / _text(file, place, key, value))
    between = {"frames": ":", "resolution": ","}.get(key)
    if isinstance(value, list) and between and all(type(part) is int for part in value):
        value = between.join(map(str, value))
    if key == "npz" or not isinstance(value, str | int | float) or isinstance(value, bool):
        raise file.error(place, f"{key} cannot be {shown(value)}", key)
    return [f"--{key.replace('_', '-')}={value}"]  # one word, because a number may be negative


def _text(file: TomlFile, place: Place, key: str, value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise file.error(place, f"{key} must be a text, not {shown(value)}", key)
    return value


@dataclass(frozen=True)
class Record:
    """What is known of a shot besides its sequence.

    That is its options and the size and time of change of its input and mask (``of``); how its last run ended, what
    the engine said then, assumed and noticed; how often it was run; the seconds of all runs and the bytes at the peak.
    ``forecast`` has the ``frames``, ``seconds`` and ``memory`` (bytes) that ``smokelift inspect`` foretells.
    """

    of: dict[str, Any]
    status: Status = "waiting"
    sentence: str = ""
    notes: list[str] = field(default_factory=list)
    runs: int = 0
    seconds: float = 0.0
    memory: int = 0
    forecast: dict[str, Any] | None = None

    def write(self, shot: BatchShot) -> None:
        """Write the file; OSError if that fails."""
        write_text(shot.file("json"), json.dumps(asdict(self), indent=1) + "\n")


def read_record(shot: BatchShot) -> Record:
    """Return the record of a shot as it is now listed; a new one if its options, input or mask have changed."""
    of: dict[str, Any] = {"options": list(shot.options), "files": []}
    masks = [word.removeprefix("--mask=") for word in shot.options if word.startswith("--mask=")]
    for path in (shot.input, *map(Path, masks)):
        with suppress(OSError):  # a pattern of pictures is no file; the engine says if there are none
            of["files"].append([path.stat().st_size, path.stat().st_mtime_ns])
    with suppress(OSError, ValueError, TypeError):  # a damaged record is none
        record = Record(**json.loads(shot.file("json").read_text(encoding="utf-8")))
        if record.of == of:
            return record
    return Record(of)


def read_index(shot: BatchShot) -> Index:
    """Return what the sequence of a shot says of its finished frames; of none if there is no sequence."""
    try:
        return Index.read(shot.directory)
    except SequenceError:
        return Index({}, {})


def is_finished(shot: BatchShot, record: Record) -> bool:
    """Return whether a shot need not be run again."""
    return record.status == "done" and read_index(shot).complete
