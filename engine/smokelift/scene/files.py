"""Text files that a user names: a pipe would be waited for without end, and a device would fill the memory."""

from __future__ import annotations

from pathlib import Path

LARGEST_TEXT = 64 * 2**20
"""Bytes of a text file, at most: the matrices of a camera that moves through 200,000 frames."""


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


def advice_on_backslashes(text: str) -> str:
    """Return how to write a path of Windows where a text that is no TOML has a backslash, else nothing."""
    return "; write a path with / or between single quotes" if "\\" in text else ""
