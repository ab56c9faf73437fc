"""Files opened with FFmpeg, which takes a path that looks like a URL for one, and fetches it."""

from __future__ import annotations

from pathlib import Path

import av
from av.container import InputContainer

OPENING_BYTES = 2**25
"""Bytes that a file is opened with: the contexts of its decoders, and some frames to know them by."""

MAX_BOXES = 1000
"""Boxes of an MP4 file that are read; a whole one has a handful, one in fragments its index among the first."""


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
    bytes(OPENING_BYTES)  # given back at once, untouched: Python says that memory lacks, where PyAV would not
    container: InputContainer = av.open(
        f"file:{path.absolute()}", format=form, options={"protocol_whitelist": "file", **options}
    )
    return container


def lacks_index(path: Path) -> bool:
    """Return whether a file is an MP4 or QuickTime one without its whole index, as a recording that was cut short is.

    Such a file is a row of boxes: eight bytes with size and name, and what it holds (ISO/IEC 14496-12, 4.2).
    """
    with path.open("rb") as file:
        end, start = path.stat().st_size, 0
        for number in range(MAX_BOXES):
            file.seek(start)
            head = file.read(16)
            if number == 0 and head[4:8] != b"ftyp":
                return False
            size = int.from_bytes(head[:4], "big")
            if head[4:8] == b"moov" and start + size <= end:
                return False
            if size == 1:  # the true size follows the name
                size = int.from_bytes(head[8:], "big")
            start += size
            if size < 8 or start + 8 > end:  # 0: up to the end of the file
                return True
    return False
