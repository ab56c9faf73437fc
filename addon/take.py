"""The files of one run. Knows nothing of Blender.

Every run has a number and writes beside the others, so that nothing that is finished is ever overwritten:

    take_0003/        the sequence, written by the engine
    take_0003.toml    the scene file that it was made from
    take_0003.json    the request: how the engine was called
    take_0003.log     what the engine said
    take_0003.png     a small picture of the last frame, input beside reconstruction
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import toml

_NAME = re.compile(r"take_(\d{4,})")


class TakeError(ValueError):
    """Files of a run that cannot be written or read, and why."""


@dataclass(frozen=True)
class Take:
    """One run's files.

    Attributes
    ----------
    directory
        Where its sequence lies.
    """

    directory: Path

    @property
    def scene_file(self) -> Path:
        """The scene file."""
        return self.directory.with_suffix(".toml")

    @property
    def request_file(self) -> Path:
        """How the engine was called."""
        return self.directory.with_suffix(".json")

    @property
    def log_file(self) -> Path:
        """What the engine said."""
        return self.directory.with_suffix(".log")

    @property
    def picture_file(self) -> Path:
        """Small picture of the last frame."""
        return self.directory.with_suffix(".png")

    def begin(self, tables: Mapping[str, Any], options: Sequence[str]) -> None:
        """Write the scene file and the request.

        Parameters
        ----------
        tables
            What the scene file holds.
        options
            The engine's further options.

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
        """Arguments that make the engine begin this take, or go on with it.

        Raises
        ------
        TakeError
            If the take was never begun, or its files were taken away.
        """
        try:
            request = json.loads(self.request_file.read_text(encoding="utf-8"))
            options = [str(word) for word in request["options"]]
        except (OSError, ValueError, LookupError, TypeError) as error:
            raise TakeError(f"{self.request_file} is missing or damaged: run the shot anew.") from error
        files = ["--out", str(self.directory), "--thumbnail", str(self.picture_file)]
        return ["reconstruct", str(self.scene_file), *files, "--resume", "--progress", "json", *options]

    def index(self) -> dict[str, Any] | None:
        """What `sequence.json` holds, or None before the engine has written it."""
        try:
            index = json.loads((self.directory / "sequence.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return index if isinstance(index, dict) else None

    def frames(self) -> int:
        """Number of finished frames."""
        index = self.index()
        return len(index["frames"]) if index else 0

    def complete(self) -> bool:
        """Whether its run came to its end."""
        index = self.index()
        return bool(index and index["complete"])

    def resumable(self) -> bool:
        """Whether it was begun and not completed."""
        return self.scene_file.is_file() and self.request_file.is_file() and not self.complete()

    def remove(self) -> None:
        """Delete all its files."""
        shutil.rmtree(self.directory, ignore_errors=True)
        for file in (self.scene_file, self.request_file, self.log_file, self.picture_file):
            file.unlink(missing_ok=True)


def takes(folder: Path) -> list[Take]:
    """The takes in a folder, oldest first."""
    if not folder.is_dir():
        return []
    numbers = {int(match[1]) for path in folder.iterdir() if (match := _NAME.fullmatch(path.stem))}
    return [Take(folder / f"take_{number:04d}") for number in sorted(numbers)]


def new_take(folder: Path) -> Take:
    """A take with the next number that is free in a folder."""
    there = takes(folder)
    last = _NAME.fullmatch(there[-1].directory.name) if there else None
    return Take(folder / f"take_{int(last[1]) + 1 if last else 1:04d}")
