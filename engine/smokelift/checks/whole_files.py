"""Files that appear whole or not at all, and text that is read from no folder, pipe or endless file."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

LARGEST_TEXT = 64 * 2**20
"""Bytes of a text file, at most: the matrices of a camera that moves through 200,000 frames."""


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Give a hidden path beside ``path`` to write to, and rename it to ``path`` when the block ends well.

    After an exception nothing is left and an older ``path`` is untouched; after a kill a hidden
    ``.NAME.PID.tmp`` may stay behind.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        with temporary.open("rb+") as file:  # else a power cut could leave the new name with nothing in it
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException as error:
        with suppress(OSError):  # what failed before says why
            temporary.unlink()
        if isinstance(error, OSError) and error.filename in (None, str(temporary)):  # the name that was asked for
            error.filename = str(path)
        raise


def write_text(path: str | Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; OSError if that fails."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def read_text(path: Path) -> str:
    """Read a text file in UTF-8.

    It raises OSError with the path, if it cannot be read, is no regular file, is too large or holds no text.
    """
    if not path.is_file() and path.exists():
        raise OSError(f"{path}: cannot be read: it is a folder, a pipe or a device, not a file")
    try:
        if path.stat().st_size > LARGEST_TEXT:
            raise OSError(f"{path}: cannot be read: it holds more than {LARGEST_TEXT >> 20} MiB; give a smaller file")
        return path.read_text(encoding="utf-8-sig")  # some editors on Windows begin a file with a byte order mark
    except UnicodeDecodeError as error:
        raise OSError(f"{path}: is not a text file in UTF-8; save it as one") from error
    except OSError as error:
        if error.strerror is None:
            raise
        raise type(error)(f"{path}: cannot be read: {error.strerror}") from error
