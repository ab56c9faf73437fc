"""A lock that keeps two runs out of one directory.

The operating system frees it when its process ends, however it ends, so no lock is ever stale.
"""

import os
import sys
from contextlib import suppress
from pathlib import Path


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
