"""The files in the directory of a sequence: their names, their content, and a lock that keeps a second run out.

The operating system frees the lock when its process ends, however it ends, so none is ever stale.
"""

import errno
import hashlib
import os
import re
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

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
            file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                free = _try_lock(file)
            except OSError:
                os.close(file)
                raise
            if not free:
                os.close(file)
                return False
            # The run that had it before may delete the file after we open it and before we lock it.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file), self._path.stat()):
                    self._file = file
                    return True
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
