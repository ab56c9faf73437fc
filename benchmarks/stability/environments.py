"""What of the system fails a run: the disk, the output folder, memory, threads, open files, the network, a signal.

Each is a context around one case. It gives what is to be done in the command's own process before the command begins,
and what makes the system well again afterwards.
"""

import ctypes
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.stability.forked import nothing
from smokelift import _core

EVENTS = ("open", "os.mkdir", "os.rename", "os.remove")
"""What a run does with its output folder, as Python's audit calls it."""

MAX_EVENTS = 52
"""Events in a run of the tiny shot that writes OpenVDB too; a run that writes less may be over before its failure."""

ORDINARY_USER = 54321
"""A number that no user has, so that all of its processes are ours."""

LARGEST_PIECE, PIECES = 2**17, 512
"""What is larger (bytes) is an array and no piece of the heap, which keeps so many halves of it."""

_CLONE_NEWNET = 0x40000000
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3

_BALLAST: list[bytes] = []


@dataclass(frozen=True)
class Failure:
    """A system that fails.

    Attributes
    ----------
    begin
        Makes it fail, in the command's process.
    mend
        Makes it well again, in the campaign's process.
    ends
        Statuses of which one is expected; without them any that a command may have, and one line.
    """

    begin: Callable[[], None] = nothing
    mend: Callable[[], None] = nothing
    ends: tuple[int, ...] = ()


Environment = Callable[[Path, np.random.Generator], AbstractContextManager[Failure]]
"""Takes the output folder, and what decides how bad it is."""


@contextmanager
def full_disk(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """The folder is a file system of too few bytes."""
    with file_system(out, f"size={4 * random.integers(1, 110)}k") as remount:
        yield Failure(mend=lambda: remount("size=64m"))


@contextmanager
def no_inodes(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """The folder is a file system of too few files."""
    with file_system(out, f"nr_inodes={random.integers(2, 12)}") as remount:
        yield Failure(mend=lambda: remount("nr_inodes=1000"))


@contextmanager
def small_files(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """No file may become larger than some kilobytes."""
    most = int(4096 * random.integers(1, 32))
    yield Failure(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)))


@contextmanager
def read_only(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """The folder takes nothing more, from the beginning or from some moment on."""
    out.mkdir()
    number = int(random.integers(MAX_EVENTS))

    def begin() -> None:
        _become_ordinary()
        if number == 0:
            out.chmod(0o555)
        else:
            _at_event(number, out, lambda: out.chmod(0o555))

    _give(out.parent)
    yield Failure(begin, lambda: out.chmod(0o755))


@contextmanager
def moved_away(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """Somebody gives the folder another name at some moment."""
    number, elsewhere = int(random.integers(2, MAX_EVENTS)), out.with_name("elsewhere")

    def mend() -> None:
        if elsewhere.exists() and not out.exists():
            elsewhere.rename(out)

    yield Failure(lambda: _at_event(number, out, lambda: out.rename(elsewhere)), mend)


@contextmanager
def small_memory(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """There are some megabytes left."""
    left = int(2 ** random.uniform(18, 26))
    yield Failure(lambda: _fill_memory(left))


@contextmanager
def few_threads(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """The user may have few processes and threads more."""
    most = int(random.integers(1, 6))

    def begin() -> None:
        _become_ordinary()
        _core.set_threads(4)  # whatever the number of cores
        resource.setrlimit(resource.RLIMIT_NPROC, (most, most))

    _give(out.parent)
    yield Failure(begin)


@contextmanager
def few_files(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """The process may open few files more."""
    more = int(random.integers(1, 10))

    def begin() -> None:
        free = os.open(os.devnull, os.O_RDONLY)
        os.close(free)
        resource.setrlimit(resource.RLIMIT_NOFILE, (free + more, free + more))

    yield Failure(begin)


@contextmanager
def no_network(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """There is no network: a run needs none."""
    yield Failure(_leave_network, ends=(0,))


@contextmanager
def terminated(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """The process is asked to end, by Ctrl-C or SIGTERM."""
    number, by = int(random.integers(1, MAX_EVENTS)), random.choice([signal.SIGINT, signal.SIGTERM])
    yield Failure(lambda: _at_event(number, out, lambda: os.kill(os.getpid(), by)), ends=(0, 130))


@contextmanager
def killed(out: Path, random: np.random.Generator) -> Iterator[Failure]:
    """The process is killed between two of the things that it does with the folder."""
    number = int(random.integers(1, MAX_EVENTS))
    begin = partial(_at_event, number, out, lambda: os.kill(os.getpid(), signal.SIGKILL))
    yield Failure(begin, ends=(0, -signal.SIGKILL))


ENVIRONMENTS: Mapping[str, Environment] = {
    "full disk": full_disk,
    "no inodes": no_inodes,
    "small files": small_files,
    "read-only folder": read_only,
    "folder moved away": moved_away,
    "small memory": small_memory,
    "few threads": few_threads,
    "few open files": few_files,
    "no network": no_network,
    "cancelled": terminated,
    "killed": killed,
}
"""What fails, by the class."""


def lacking(name: str, folder: Path) -> str:
    """Return why an environment cannot be made here; "" if it can.

    Parameters
    ----------
    name
        Of `ENVIRONMENTS`.
    folder
        Where its cases are to lie.
    """
    if not sys.platform.startswith("linux"):
        return "needs Linux"
    if os.geteuid() != 0:
        return "needs root" if name in ("full disk", "no inodes", "no network") else ""
    if name in ("read-only folder", "few threads"):  # which nothing can refuse to root
        closed = [place for place in (folder, *folder.parents) if not place.stat().st_mode & 0o001]
        return f"no other user can reach {closed[0]}" if closed else ""
    if name in ("full disk", "no inodes"):
        mount = subprocess.run(["unshare", "--mount", "mount", "-t", "tmpfs", "none", folder], capture_output=True)
        return "the system mounts no file system" if mount.returncode else ""
    if name == "no network" and subprocess.run(["unshare", "--net", "true"]).returncode:
        return "the system gives no network of its own"
    return ""


@contextmanager
def file_system(out: Path, options: str) -> Iterator[Callable[[str], None]]:
    """A file system in memory with these options; it is given others by what this yields."""
    out.mkdir()

    def mount(options: str) -> None:
        subprocess.run(["mount", "-t", "tmpfs", "-o", options, "none", out], check=True)

    mount(options)
    try:
        yield lambda others: mount(f"remount,{others}")
    finally:
        subprocess.run(["umount", out], check=True)


def _give(folder: Path) -> None:
    """Let an ordinary user have a folder, if this is none."""
    if os.geteuid() == 0:
        for path in (folder, *folder.rglob("*")):
            os.chown(path, ORDINARY_USER, ORDINARY_USER)


def _become_ordinary() -> None:
    """Go on as a user whom limits and permissions bind."""
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(ORDINARY_USER)
        os.setuid(ORDINARY_USER)


def _fill_memory(left: int) -> None:
    """Take all memory but so many bytes; small pieces stay to be had from the heap.

    NumPy's iterators end the process where their buffers of 64 KiB cannot be had: they raise without the lock.
    """
    heap = ctypes.CDLL(None)
    heap.mallopt(_M_MMAP_THRESHOLD, LARGEST_PIECE)
    heap.mallopt(_M_TRIM_THRESHOLD, 2 * PIECES * LARGEST_PIECE)
    pieces = [bytes(LARGEST_PIECE // 2) for _ in range(PIECES)]
    del pieces
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + left + 2**20  # an array is a little larger than what it holds
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    kept_free = bytearray(left)
    with suppress(MemoryError):
        while True:
            _BALLAST.append(bytes(2**20))
    del kept_free


def _leave_network() -> None:
    """Go on in a network that has no way out, not even to this machine."""
    if ctypes.CDLL(None, use_errno=True).unshare(_CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), "unshare")


def _at_event(number: int, out: Path, act: Callable[[], object]) -> None:
    """Do something just before the run does for the given time something with its output folder."""
    left = number

    def audit(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal left
        if event in EVENTS and isinstance(arguments[0], str | os.PathLike):
            left -= out.name in Path(arguments[0]).parts
            if left == 0:
                left = -1
                act()

    sys.addaudithook(audit)
