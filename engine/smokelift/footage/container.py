"""Files opened with FFmpeg, which takes a path that looks like a URL for one, and fetches it."""

from __future__ import annotations

from pathlib import Path

import av
from av.container import InputContainer

ENOUGH = 2**25
"""Bytes that a file is opened with: the contexts of its decoders, and some frames to know them by."""


def open_container(path: Path, form: str | None = None, **options: str) -> InputContainer:
    """Open a file, and whatever it refers to on this machine, but nothing on another.

    Parameters
    ----------
    path
        The file, whatever characters are in its name.
    form
        FFmpeg's name of the format; None takes what the content shows.
    options
        Of that format.

    Raises
    ------
    av.FFmpegError, ValueError
        If it is of no format that FFmpeg knows, or damaged.
    MemoryError
        If there is hardly any memory left, where PyAV would end the process.
    """
    bytearray(ENOUGH)  # given back at once: Python says that memory lacks, where PyAV would not
    container: InputContainer = av.open(
        f"file:{path.absolute()}", format=form, options={"protocol_whitelist": "file", **options}
    )
    return container
