"""What a command may do with damaged input: end well, or end with one line and a status, and touch nothing else."""

from collections.abc import Mapping
from pathlib import Path

from benchmarks.stability.forked import Ended

STATUSES = (0, 2, 3, 130)
"""Done, bad input, device or memory, cancelled."""


def files_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of everything below a folder."""
    return {
        str(path.relative_to(folder)): (path.lstat().st_size, path.lstat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
        if not path.is_dir()
    }


def verdict(ended: Ended, before: Mapping[str, object], after: Mapping[str, object], out: str) -> str:
    """Return in a word what is wrong with how a command ended; "" if nothing is.

    Parameters
    ----------
    before, after
        `files_of` its folder.
    out
        Beginning of the names that it may write.
    """
    if ended.hung:
        return "hung"
    if "Traceback" in ended.errors:
        return "traceback"
    if ended.status < 0:
        return "signal"
    if ended.status not in STATUSES:
        return "status"
    if ended.status and len(ended.errors.strip().splitlines()) != 1:
        return "not one line"
    touched = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    return "other files" if any(not name.startswith(out) for name in touched) else ""
