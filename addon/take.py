"""A take: the files of one run. Knows nothing of Blender.

Every take has the next free number, so no run overwrites another:

    take_0003/        the sequence, written by the engine
    take_0003.toml    its scene file
    take_0003.json    the engine's further options
    take_0003.log     the engine's messages
    take_0003.png     a thumbnail of the last frame, input beside reconstruction
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import toml
from .contract import INDEX_FILE

OPTIONS = ("--quality", "--device", "--detail", "--seed", "--resolution", "--axis-depth")
"""The engine's options that a take may hold: those that decide the result."""

_NAME = re.compile(r"take_(\d{4,})")


class TakeError(ValueError):
    """A take whose files cannot be written or read; says why in one sentence."""


@dataclass(frozen=True)
class Take:
    """One run's files; ``directory`` holds its sequence."""

    directory: Path

    @property
    def scene_file(self) -> Path:
        """The scene file."""
        return self.directory.with_suffix(".toml")

    @property
    def request_file(self) -> Path:
        """The engine's further options."""
        return self.directory.with_suffix(".json")

    @property
    def log_file(self) -> Path:
        """The engine's messages."""
        return self.directory.with_suffix(".log")

    @property
    def thumbnail_file(self) -> Path:
        """The thumbnail of the last frame."""
        return self.directory.with_suffix(".png")

    def write(self, tables: Mapping[str, Any], options: Sequence[str]) -> None:
        """Write the scene file from its tables, and the engine's further options.

        Raises
        ------
        TakeError
            If the folder cannot be written to.
        """
        try:
            self.directory.parent.mkdir(parents=True, exist_ok=True)
            self.scene_file.write_text(toml.dumps(tables), encoding="utf-8")
            self.request_file.write_text(json.dumps({"options": list(options)}) + "\n", encoding="utf-8")
        except OSError as error:
            raise TakeError(
                f"{self.directory.parent} cannot be written to ({error.strerror}): choose another output folder."
            ) from error

    def arguments(self) -> list[str]:
        """The engine's arguments, which start this take or resume it.

        Raises
        ------
        TakeError
            If its files are missing or damaged, or hold an option that is none of `OPTIONS`.
        """
        try:
            request = json.loads(self.request_file.read_text(encoding="utf-8"))
            options = [str(word) for word in request["options"]]
        except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
            raise TakeError(f"{self.request_file} is missing or damaged: make the smoke again.") from error
        for word in options:
            # the file may come with somebody else's project, and must not choose what is written where
            if word.startswith("-") and word.partition("=")[0] not in OPTIONS:
                raise TakeError(f"{self.request_file} asks for {word!r}, which no shot does: make the smoke again.")
        files = ["--out", str(self.directory), "--thumbnail", str(self.thumbnail_file)]
        return ["reconstruct", str(self.scene_file), *files, "--resume", "--progress", "json", *options]

    def index(self) -> dict[str, Any] | None:
        """The content of `sequence.json`; None before the engine writes it."""
        try:
            index = json.loads((self.directory / INDEX_FILE).read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        return index if isinstance(index, dict) else None

    def frames(self) -> int:
        """Number of finished frames."""
        index = self.index()
        return len(index["frames"]) if index else 0

    def complete(self) -> bool:
        """Whether all its frames are finished."""
        index = self.index()
        return bool(index and index["complete"])

    def resumable(self) -> bool:
        """Whether its run can go on: it started and is not complete."""
        return self.scene_file.is_file() and self.request_file.is_file() and not self.complete()

    def title(self) -> str:
        """The name that the artist gave it, or its number."""
        try:
            given = str(json.loads(self.request_file.read_text(encoding="utf-8")).get("title", ""))
        except (OSError, ValueError, AttributeError, RecursionError):
            given = ""
        return given or f"Take {int(self.directory.name.rpartition('_')[2])}"

    def give_title(self, title: str) -> None:
        """Give it a name.

        Raises
        ------
        TakeError
            If its files are missing or damaged, or the name cannot be written.
        """
        try:
            request = json.loads(self.request_file.read_text(encoding="utf-8"))
            self.request_file.write_text(json.dumps({**request, "title": title}) + "\n", encoding="utf-8")
        except (OSError, ValueError, TypeError, RecursionError) as error:
            raise TakeError(f"{self.request_file} cannot be changed, so the result keeps its name.") from error

    def size(self) -> float:
        """Size of its sequence on the disk (MB)."""
        try:
            with os.scandir(self.directory) as files:
                return sum(file.stat().st_size for file in files) / 1e6
        except OSError:
            return 0.0

    def remove(self) -> None:
        """Delete all its files."""
        shutil.rmtree(self.directory, ignore_errors=True)
        for file in (self.scene_file, self.request_file, self.log_file, self.thumbnail_file):
            file.unlink(missing_ok=True)


def takes(folder: Path) -> list[Take]:
    """The takes in a folder, oldest first."""
    return [_take(folder, number) for number in sorted(_numbers(folder))]


def new_take(folder: Path) -> Take:
    """The take with the next free number in a folder."""
    return _take(folder, max(_numbers(folder), default=0) + 1)


def _take(folder: Path, number: int) -> Take:
    return Take(folder / f"take_{number:04d}")


def _numbers(folder: Path) -> set[int]:
    if not folder.is_dir():
        return set()
    return {int(match[1]) for path in folder.iterdir() if (match := _NAME.fullmatch(path.stem))}
