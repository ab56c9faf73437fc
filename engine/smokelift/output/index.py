"""What is in the directory of a sequence: its files' names, a lock that keeps a second run out, and `sequence.json`.

That says what the sequence was made from, and which of its frames are finished. The operating system frees the lock
when its process ends, however it ends, so none is ever stale.
"""

import errno
import hashlib
import json
import math
import os
import platform
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import starmap
from pathlib import Path
from statistics import median
from typing import Any, get_origin, get_type_hints

import numpy as np

from smokelift.checks import shown
from smokelift.checks.whole_files import read_text, write_text
from smokelift.scene import Domain, SceneError
from smokelift.scene.checks import file_path

INDEX = "sequence.json"
RESUME = "resume.npz"
LOCK = "run.lock"
BACKGROUND = "background.exr"
CONTACT_SHEET = "contact_sheet.png"
ORBIT = "orbit.png"
STRIP = "strip.png"
PREVIEW = "preview.mp4"

PICTURES = (CONTACT_SHEET, ORBIT, STRIP, PREVIEW)
"""What shows a sequence at a glance; nothing is computed from it."""

MAX_START_NUMBER = 1_000_000
"""Largest number of a first file: Blender's timeline ends at 1,048,574."""

DISK_FULL = (errno.ENOSPC, errno.EDQUOT)
"""Numbers of the errors by which a system says that a disk, or a user's share of it, is full."""

_FRAME = re.compile(r"smoke_\d{4,}\.(vdb|npz)|proxy_\d{4,}\.vdb")

FORMAT = 1
"""Version of the file's structure (by definition); any other is refused."""

BOX = "box"
"""Key in the figures of a frame whose files have a box of their own, with the keys of a scene's domain: smoke that
is simulated outgrows the clip's."""

SAME_SIZE = 1e-3
"""Relative difference below which two sizes of voxels are the same: files hold their edges with so many digits."""

FILES = ("path", "image", "mask", "strokes")
"""Keys of a scene that hold paths."""


def frame_path(directory: Path, number: int, kind: str) -> Path:
    """Return the file with a number in its name; the kind is ``"vdb"`` or ``"npz"``."""
    return directory / f"smoke_{number:04d}.{kind}"


def proxy_path(directory: Path, number: int) -> Path:
    """Return the coarse copy of the file with that number in its name."""
    return directory / f"proxy_{number:04d}.vdb"


def is_foreign(name: str) -> bool:
    """Return whether no run writes a file of this name.

    What begins with a dot is left over from a killed run, or the file manager's.
    """
    known = (INDEX, RESUME, LOCK, BACKGROUND, *PICTURES)
    return not (name in known or name.startswith(".") or _FRAME.fullmatch(name))


def checksum(paths: Iterable[Path]) -> str:
    """Return the SHA-256 of the content of files, one after the other, as hexadecimal digits."""
    total = hashlib.sha256()
    for path in paths:
        with path.open("rb") as file:
            total.update(hashlib.file_digest(file, "sha256").digest())
    return total.hexdigest()


class Lock:
    """An exclusive lock on a file, which exists while the lock is held."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None

    def acquire(self) -> bool:
        """Take the lock; False if another process has it.

        It raises OSError if the file cannot be made, or its file system has no locks.
        """
        while True:
            file, taken = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644), False
            try:
                if not _try_lock(file):
                    return False
                # The run that had it before may delete the file after we open it and before we lock it.
                with suppress(FileNotFoundError):
                    taken = os.path.samestat(os.fstat(file), self._path.stat())
                if taken:
                    self._file = file
                    return True
            finally:
                if not taken:
                    os.close(file)

    def release(self) -> None:
        """Free the lock and delete its file."""
        if self._file is None:
            return
        if sys.platform == "win32":
            os.close(self._file)  # an open file cannot be deleted there
            with suppress(OSError):
                self._path.unlink()
        else:
            self._path.unlink(missing_ok=True)
            os.close(self._file)
        self._file = None


def _try_lock(file: int) -> bool:
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except OSError:  # the number for the lock of another differs between C libraries
            return False
    else:
        import fcntl

        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


class SequenceError(ValueError):
    """A directory that cannot be written to or opened, and why."""


class DirectoryBusyError(SequenceError):
    """A directory that another run is writing into."""


def directory_path(value: object) -> Path:
    """Return what is given as the directory of a sequence, or raise a SequenceError."""
    try:
        return file_path(value, "directory", "the path of a directory")
    except SceneError as error:
        raise SequenceError(str(error)) from error


@cache
def _software_versions() -> dict[str, str]:
    versions = {"python": platform.python_version()}
    for name in ("smokelift", "numpy", "scipy", "taichi", "av"):
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    # from one version to the next the program changes many times
    return {**versions, "code": checksum(sorted(Path(__file__).parents[1].rglob("*.py")))}


@dataclass(frozen=True)
class Index:
    """The content of the file, as plain values."""

    scene: dict[str, Any]
    """The tables of a scene file."""
    settings: dict[str, Any]
    """All settings that decide the result."""
    choices: list[Any] = field(default_factory=list)
    """What was chosen for the clip and why. Not compared when a run goes on: what they decided is in the scene and the
    settings."""
    provenance: list[Any] = field(default_factory=list)
    """What of the result is measured, estimated, assumed and made up. Not compared either."""
    frames: dict[str, Any] = field(default_factory=dict)
    """The figures of every finished frame, by its number as text."""
    sources: dict[str, Any] = field(default_factory=dict)
    """Size and content of the files that the run reads, and frames that it takes the background from, by their table in
    a scene file."""
    checksums: dict[str, str] = field(default_factory=dict)
    """Of the frames' files, by name."""
    complete: bool = False
    """Whether the run came to its end."""
    start_number: int = 1
    """Number in the names of the files of frame 1."""
    versions: dict[str, Any] = field(default_factory=_software_versions)
    """Of what a result depends on, and the checksum of the program's own code."""

    @property
    def numbers(self) -> tuple[int, ...]:
        """The finished frames' numbers, in order."""
        return tuple(sorted(map(int, self.frames)))

    def file_number(self, number: int) -> int:
        """The number in the names of a frame's files."""
        return number + self.start_number - 1

    def box(self, number: int, otherwise: Domain) -> Domain:
        """The box of a frame's files, where it is not the scene's; its voxels are those of the scene's."""
        given = self.frames[str(number)].get(BOX)
        if given is None:
            return otherwise
        try:
            box = Domain(**given)
        except (TypeError, ValueError) as error:
            raise SequenceError(f"{INDEX} is damaged: the box of frame {number}: {error}") from error
        if abs(box.voxel_size / otherwise.voxel_size - 1) > SAME_SIZE:
            raise SequenceError(f"{INDEX} is damaged: the box of frame {number} has voxels of another size")
        return box

    def write(self, directory: Path) -> None:
        """Write the file; OSError if that fails."""
        # with indents the encoder is many times slower, and every frame is written anew
        parts = {name: json.dumps(value, allow_nan=False) for name, value in {"format": FORMAT, **vars(self)}.items()}
        parts["frames"] = _lines({number: json.dumps(figures) for number, figures in self.frames.items()})
        write_text(directory / INDEX, _lines(parts) + "\n")

    @staticmethod
    def read(directory: Path) -> "Index":
        """Read the file of a directory; SequenceError if it is missing, damaged or of another format."""
        path = directory / INDEX
        try:
            data = json.loads(read_text(path))
        except FileNotFoundError:
            raise SequenceError(
                f"{directory}: holds no sequence ({INDEX} is missing); give a directory that a run wrote"
            ) from None
        except OSError as error:
            raise SequenceError(str(error)) from error
        except (ValueError, RecursionError) as error:
            raise SequenceError(f"{path}: cannot be read: {error}") from error
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            raise SequenceError(f"{path}: is not a sequence of format {FORMAT}, which this version reads")
        data = {"start_number": 1, **data}  # version 1.0.0 writes none
        kinds = {key: get_origin(hint) or hint for key, hint in get_type_hints(Index).items()}
        for key, kind in kinds.items():
            if not isinstance(data.get(key), kind):
                raise SequenceError(f"{path}: is damaged: {key} is missing or of another type")
        if not 0 <= data["start_number"] <= MAX_START_NUMBER:
            raise SequenceError(f"{path}: is damaged: start_number cannot be {shown(data['start_number'])}")
        for number, figures in data["frames"].items():
            if not re.fullmatch(r"0|[1-9][0-9]{0,8}", number) or not isinstance(figures, dict):
                raise SequenceError(f"{path}: is damaged: there can be no frame {shown(number)} of {shown(figures)}")
        return Index(**{key: data[key] for key in kinds})


def work_seconds(figures: Mapping[str, Any]) -> float:
    """Return what a frame took; nothing for one that is copied from its source, whose figures it has."""
    if figures.get("origin") == "clip":
        return 0.0
    return float(figures.get("seconds_density") or 0.0) + float(figures.get("seconds_velocity") or 0.0)


def median_psnr(figures: Iterable[Mapping[str, Any]]) -> float | None:
    """Return the median ``psnr`` (dB) of frames; None if none has one."""
    decibels = [of_frame["psnr"] for of_frame in figures if of_frame.get("psnr") is not None]
    return median(decibels) if decibels else None


def _lines(values: Mapping[str, str]) -> str:
    """The JSON object of values that are JSON already, each in a line of its own."""
    return "{\n" + ",\n".join(f"{json.dumps(name)}: {value}" for name, value in values.items()) + "\n}"


def json_value(value: Any) -> Any:
    """Return a value as JSON holds it: arrays become lists, and numbers that are not finite become None."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def other_program(index: Index) -> str:
    """Return in words how what computed a run differs from this program, or an empty string."""
    there, now = ({**found, "python": ""} for found in (index.versions, _software_versions()))  # a patch is none
    code = there.pop("code", None) != now.pop("code")
    return _difference("versions", there, now) or "its code has changed" * code


def first_change(before: Index, now: Index) -> str:
    """Return in words the first thing that differs between two runs and has to be the same, or an empty string."""
    pairs = zip(_compared(before), _compared(now), strict=True)
    return next(filter(None, (_difference(name, there, here) for (name, there), (_, here) in pairs)), "")


def _compared(index: Index) -> Iterator[tuple[str, Any]]:
    """What is compared, with the name that is said. Causes come before what follows from them.

    Another clip, say, makes another scene, and another scene other settings of a part.
    """
    yield "sources", index.sources
    # those of the whole run: settings of its parts follow from a scene too
    yield "settings", {key: value for key, value in index.settings.items() if not isinstance(value, dict)}
    yield "start_number", index.start_number
    # checksums distinguish the files, wherever a project was moved to
    yield "scene", _without_folders(index.scene) if index.sources else index.scene
    yield "settings", index.settings


def _without_folders(scene: Any) -> Any:
    """The plain values of a scene with the names of its files in place of their paths."""
    if isinstance(scene, dict):
        return {
            key: Path(value).name if key in FILES and isinstance(value, str) else _without_folders(value)
            for key, value in scene.items()
        }
    return [_without_folders(value) for value in scene] if isinstance(scene, list) else scene


def _difference(place: str, there: Any, now: Any) -> str:
    """The first difference between two plain values as words, or an empty string."""
    if isinstance(there, dict) and isinstance(now, dict):
        parts = [(f"{place}.{key}", there.get(key), now.get(key)) for key in there | now]
    elif isinstance(there, list) and isinstance(now, list) and len(there) == len(now):
        parts = [(f"{place}[{n}]", *pair) for n, pair in enumerate(zip(there, now, strict=True))]
    elif there == now:
        return ""
    else:
        before, after = (text if len(text) <= 60 else f"{text[:57]}..." for text in map(json.dumps, (there, now)))
        return f"{place} was {before} and is now {after}"
    return next(filter(None, starmap(_difference, parts)), "")
