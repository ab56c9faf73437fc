"""The compiled core that runs fastest on this processor."""

from pathlib import Path

WANTED = {"avx2", "fma"}
"""Instruction sets of the second core, as Linux calls them (`cpp/CMakeLists.txt`)."""


def faster_core(package: Path, cpuinfo: Path = Path("/proc/cpuinfo")) -> str | None:
    """Folder to import the core from rather than from the package's own.

    GCC puts the hot loops for several instruction sets into one core. Other compilers cannot, as the one of the
    Blender extension, so their core for newer processors is a file of its own in the folder `avx2`.

    Parameters
    ----------
    package
        Folder of the package.
    cpuinfo
        Where Linux says what the processor has. It leaves out what the system does not let programs use.

    Returns
    -------
    The folder, where it is there and this processor can run what is in it; else None.
    """
    folder = package / "avx2"
    return str(folder) if folder.is_dir() and _features(cpuinfo) >= WANTED else None


def _features(cpuinfo: Path) -> set[str]:
    try:
        with cpuinfo.open(encoding="utf-8", errors="replace") as lines:
            return set(next((line for line in lines if line.startswith("flags")), "").split())
    except OSError:
        return set()
