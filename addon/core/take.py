"""A take: the files of one run.

Every take has the next free number, so no run overwrites another:

    take_0003/        the sequence, written by the engine
    take_0003.toml    its scene file
    take_0003.json    the engine's further options, and the .blend files that may show it
    take_0003.log     the engine's messages
    take_0003.png     a thumbnail of the last frame, input beside reconstruction
    take_0003_mask.png  the mask, if it was drawn in Blender
    take_0003_mask_####.png  the same where it moves, for every frame

One that is made of another take, which goes on after its clip, has another speed or repeats, has no scene file:

    take_0004.json    what is done, the other take, and the engine's further options
    take_0004_####.stl  the meshes that are obstacles, if there are any: for every frame as long as they move
"""

import json
import os
import re
import shutil
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from . import ShotError
from .contract import DIRECTIONS, INDEX_FILE

OPTIONS = ("--quality", "--device", "--detail", "--seed", "--resolution", "--distance", "--start-number")
"""The engine's options that a take may hold: those that decide the result."""

TITLES = {"continue": "Continued", "retime": "Retimed", "loop": "Loop"}  # what a take is called that is made of another
CACHED = 128  # takes whose files are kept in memory: more than a list shows at once
_NUMBER = re.compile(r"-?\d+(\.\d+)?(:\d+)?")  # a number or a range of frames; never an option

_NAME = re.compile(r"take_(\d{4,})")


@dataclass(frozen=True)
class Take:
    """One run's files, as above; ``directory`` holds its sequence."""

    directory: Path

    @property
    def scene_file(self) -> Path:
        return self.directory.with_suffix(".toml")

    @property
    def request_file(self) -> Path:
        return self.directory.with_suffix(".json")

    @property
    def log_file(self) -> Path:
        return self.directory.with_suffix(".log")

    @property
    def thumbnail_file(self) -> Path:
        return self.directory.with_suffix(".png")

    def copy_mask(self, drawn: Path) -> str:
        """Copy its drawn mask, a picture or a pattern; returns what its scene file has. ShotError if that fails."""
        files = drawn.parent.glob(drawn.name.replace("####", "*"))
        self._write({Path(f"{self.directory}_{file.name}"): file.read_bytes() for file in files})
        return f"{self.directory.name}_{drawn.name}"

    def write(self, tables: Mapping[str, Any], options: Sequence[str]) -> None:
        """Write the scene file from its tables, and the engine's further options; ShotError if that fails."""
        self._write({self.scene_file: toml_text(tables).encode(), self.request_file: _request(options)})

    def write_directed(
        self, direction: str, source: "Take", options: Sequence[str], meshes: Sequence[bytes] = ()
    ) -> None:
        """Write what is made of another take, by a direction of `DIRECTIONS`.

        Meshes are obstacles, as a binary STL file, one for each frame if they move. ShotError if that fails.
        """
        request = _request(options, direction=direction, source=_relative_path(self.directory.parent, source.directory))
        files = {Path(f"{self.directory}_{n:04d}.stl"): content for n, content in enumerate(meshes)}
        self._write({**files, self.request_file: request})

    def _write(self, files: Mapping[Path, bytes]) -> None:
        try:
            self.directory.parent.mkdir(parents=True, exist_ok=True)
            for file, content in files.items():
                file.write_bytes(content)
        except OSError as error:
            raise ShotError(
                f"{self.directory.parent} cannot be written to ({error.strerror}): choose another output folder."
            ) from error

    def read(self) -> "Snapshot":
        """What its files say now; read again only when one of them has changed: the panel asks with every redraw."""
        files = (self.request_file, self.directory / INDEX_FILE, self.scene_file)
        return _snapshot_at(self, *map(_file_state, files))

    def update_moved_files(self, files: Mapping[tuple[str, str], Path]) -> None:
        """Write today's paths into its scene file for files that are not where they were: the project was moved.

        Each is given by the table that it is in, and its key there. ShotError if that fails.
        """
        try:
            tables = tomllib.loads(self.scene_file.read_text(encoding="utf-8"))
            named = {(table, key): tables.get(table, {}).get(key) for table, key in files}
        except (OSError, ValueError, AttributeError) as error:
            raise ShotError(f"{self.scene_file} is missing or damaged: make the smoke again.") from error
        moved = [at for at, path in named.items() if isinstance(path, str) and not self._has(path)]
        found = {at: str(files[at]) for at in moved if files[at].is_file()}
        for (table, key), path in found.items():
            tables[table][key] = path
        if found:
            self._write({self.scene_file: toml_text(tables).encode()})

    def _has(self, path: str) -> bool:
        """Whether there is a file of its scene file, or those of a pattern."""
        file = self.directory.parent / path
        return file.is_file() or ("#" in file.name and any(file.parent.glob(re.sub("#+", "[0-9]*", file.name))))

    def arguments(self) -> list[str]:
        """The engine's arguments, which start or resume it; ShotError if files are damaged, or hold other options."""
        now = self.read()
        direction, source, options = now.direction, now.source, now.options
        if options is None:
            raise ShotError(f"{self.request_file} is missing or damaged: make the smoke again.")
        known = OPTIONS if direction is None else DIRECTIONS[direction]
        for word in options:
            # the file may come with somebody else's project, and must not choose what is written where
            if word.startswith("-") and word.partition("=")[0] not in known and not _NUMBER.fullmatch(word):
                raise ShotError(f"{self.request_file} asks for {word!r}, which no shot does: make the smoke again.")
        run = ["--out", str(self.directory), "--resume", "--progress", "json", *options]
        if direction is None or source is None:
            return ["reconstruct", str(self.scene_file), "--thumbnail", str(self.thumbnail_file), *run]
        for end in ("_####.stl", ".stl"):  # the second of an earlier version
            if self._has(f"{self.directory.name}{end}"):
                run += ["--mesh", f"{self.directory}{end}"]
        return [direction, str(source.directory), *run]

    def give_title(self, title: str) -> None:
        """Give it a name; ShotError if its files are missing or damaged, or the name cannot be written."""
        try:
            self._change_request("title", title)
        except (OSError, ValueError, TypeError, RecursionError) as error:
            raise ShotError(f"{self.request_file} cannot be changed, so the result keeps its name.") from error

    def note_file(self, blend: Path) -> None:
        """Keep in mind that a .blend may show it, where it can be written; one of an earlier version knows of none."""
        known = self.read().files
        if known is not None and blend.resolve() not in known:
            folder = self.directory.parent.resolve()
            files = [_relative_path(folder, file) for file in sorted({*known, blend.resolve()})]
            with suppress(OSError, ValueError, TypeError, RecursionError):
                self._change_request("files", files)

    def _change_request(self, key: str, value: Any) -> None:
        request = json.loads(self.request_file.read_text(encoding="utf-8"))
        self.request_file.write_text(json.dumps({**request, key: value}) + "\n", encoding="utf-8")

    def size(self) -> float:
        """Size of its sequence on the disk (MB)."""
        try:
            return _size_at(self.directory, self.directory.stat().st_mtime_ns)
        except OSError:
            return 0.0

    def remove_unless_begun(self) -> None:
        """Delete its files if the engine never wrote any."""
        if not self.directory.exists():
            self.remove()

    def remove(self) -> None:
        """Delete all its files."""
        shutil.rmtree(self.directory, ignore_errors=True)
        for file in self.directory.parent.glob(f"{self.directory.name}[._]*"):
            file.unlink(missing_ok=True)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """What the files of a take say at one time."""

    direction: str | None  # what is done to another take, by `DIRECTIONS`; None of one of a clip, or damaged
    source: Take | None  # the other take; None likewise
    options: list[str] | None  # the engine's further options; None where the request is missing or damaged
    title: str  # the name that the artist gave it, or its number
    index: dict[str, Any]  # `sequence.json`, not to be changed; empty before there is one, or of a foreign one
    scene: Any  # the tables of its scene as the engine completed them; None without an index
    numbers: list[int]  # those of the finished frames
    file_numbers: list[int]  # those in the names of their files; the engine of earlier versions counts from 1
    complete: bool  # whether all frames are finished
    resumable: bool  # whether the run can go on: it started and is not complete
    files: frozenset[Path] | None  # .blend files, without links, that may show it; None where a list was never kept

    @property
    def frames(self) -> int:
        """Number of finished frames."""
        return len(self.numbers)


FileState = tuple[int, int, int] | None  # time, number and size, by which a change is seen; None of a missing file


def _file_state(file: Path) -> FileState:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ino, found.st_size


@lru_cache(CACHED)
def _snapshot_at(take: Take, request_state: FileState, _index_state: FileState, scene_state: FileState) -> Snapshot:
    """The snapshot of a take whose files are in these states."""
    request, index = _json(take.request_file), _json(take.directory / INDEX_FILE)
    frames = index.get("frames")
    if "complete" not in index or not isinstance(frames, dict) or not all(number.isdecimal() for number in frames):
        index = {}
    direction, there, options = (request.get(key) for key in ("direction", "source", "options"))
    if not isinstance(direction, str) or direction not in DIRECTIONS:
        direction = None
    folder = take.directory.parent
    source = Take(Path(os.path.normpath(folder / there))) if isinstance(there, str) else None
    if not isinstance(options, list) or ("direction" in request and (direction is None or source is None)):
        options = None
    begun = request_state is not None and (direction is not None or scene_state is not None)
    number, files = take.directory.name.rpartition("_")[2].lstrip("0"), request.get("files")
    numbers, complete = sorted(map(int, index.get("frames", ()))), bool(index.get("complete"))
    return Snapshot(
        direction=direction,
        source=source,
        options=None if options is None else [str(word) for word in options],
        title=str(request.get("title", "")) or f"{TITLES.get(direction or '', 'Take')} {number}",
        index=index,
        scene=index.get("scene"),
        numbers=numbers,
        file_numbers=[number + index.get("start_number", 1) - 1 for number in numbers],
        complete=complete,
        resumable=begun and not complete,
        files=frozenset((folder / str(file)).resolve() for file in files) if isinstance(files, list) else None,
    )


def _relative_path(folder: Path, path: Path) -> str:
    """A path as files in a folder keep it: relative, so that a project can be moved, unless it is on another drive."""
    try:
        return os.path.relpath(path, folder)
    except ValueError:
        return str(path)


def _request(options: Sequence[str], **further: str) -> bytes:
    """The content of the request of a new take, which no file shows yet."""
    return (json.dumps({**further, "options": list(options), "files": []}) + "\n").encode()


def _json(file: Path) -> dict[str, Any]:
    """The object in a file; nothing if that is missing or damaged."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


@lru_cache(CACHED)
def _size_at(directory: Path, _time: int) -> float:
    """Size of the files in a directory as of its last change (MB)."""
    with os.scandir(directory) as files:
        return sum(file.stat().st_size for file in files) / 1e6


def takes(folder: Path) -> list[Take]:
    """The takes in a folder, oldest first."""
    named = (_NAME.fullmatch(path.stem) for path in (folder.iterdir() if folder.is_dir() else ()))
    return [Take(folder / f"take_{n:04d}") for n in sorted({int(match[1]) for match in named if match})]


def new_take(folder: Path) -> Take:
    """The take with the next free number in a folder."""
    number = max((int(take.directory.name.removeprefix("take_")) for take in takes(folder)), default=0) + 1
    return Take(folder / f"take_{number:04d}")


def toml_text(tables: Mapping[str, Any]) -> str:
    """The text of a TOML file, whose tables, and lists of them, hold numbers, texts, or nested lists of those."""
    parts = []
    for name, content in tables.items():
        header, listed = (f"[[{name}]]", content) if isinstance(content, list) else (f"[{name}]", [content])
        for table in listed:
            lines = [header, *(f"{key} = {_toml_value(value)}" for key, value in table.items())]
            parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _toml_value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml_value(item) for item in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML's texts are JSON's but for this
    return repr(value)
