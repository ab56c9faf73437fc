"""The pictures of an image sequence as the engine counts them, those that are missing too.

Blender ends a sequence at its first gap.
"""

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

CACHED = 16  # sequences that are kept in memory: the panel asks with every redraw
LISTED = 3  # names of missing pictures that are listed


@dataclass(frozen=True)
class ImageSequence:
    """A sequence of numbered pictures."""

    count: int  # from the first to the last, with those that are missing in between
    missing: tuple[str, ...]  # names of these

    def missing_names(self) -> str:
        """The first names of those that are missing, and how many there are more."""
        listed = ", ".join(self.missing[:LISTED])
        more = len(self.missing) - LISTED
        return f"{listed} and {more} more" if more > 0 else listed


def image_sequence_from(first: Path) -> ImageSequence | None:
    """The sequence that begins with a numbered picture; None where there is none, or most of it is missing."""
    try:
        return _image_sequence_at(first, first.parent.stat().st_mtime_ns)
    except OSError:
        return None


@lru_cache(CACHED)
def _image_sequence_at(first: Path, _time: int) -> ImageSequence | None:
    """The sequence in a folder as of its last change."""
    named = re.fullmatch(r"(.*?)(\d+)(\.[^.]+)", first.name)
    if named is None or named[1].endswith("-"):
        return None
    prefix, number, suffix = named.groups()
    digits = len(number)
    name = re.compile(re.escape(prefix) + rf"(\d{{{digits},}})" + re.escape(suffix))
    found = {int(match[1]) for file in first.parent.iterdir() if (match := name.fullmatch(file.name))}
    found = {n for n in found if n >= int(number)}
    if int(number) not in found:
        return None
    missing = sorted(set(range(int(number), max(found))) - found)
    if len(missing) > len(found):
        return None
    return ImageSequence(len(found) + len(missing), tuple(f"{prefix}{n:0{digits}d}{suffix}" for n in missing))
