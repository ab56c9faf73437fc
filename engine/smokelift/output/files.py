"""The files in the directory of a sequence: their names, and their content."""

import errno
import hashlib
import re
from collections.abc import Iterable
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
