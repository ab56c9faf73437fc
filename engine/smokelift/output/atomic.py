"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

DISK_FULL = (errno.ENOSPC, errno.EDQUOT)
"""Numbers of the errors by which a system says that a disk, or a user's share of it, is full."""


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Give a hidden path beside ``path`` to write to, and rename it to ``path`` when the block ends well.

    After an exception nothing is left and an older ``path`` is untouched; after a kill a hidden
    ``.NAME.PID.tmp`` may stay behind.
    """
    path = Path(path)
    aside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield aside
        with aside.open("rb+") as file:  # else a power cut could leave the new name with nothing in it
            os.fsync(file.fileno())
        aside.replace(path)
    except BaseException as error:
        aside.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename in (None, str(aside)):  # the name that was asked for
            error.filename = str(path)
        raise
