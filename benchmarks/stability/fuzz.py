"""A fuzzer for the readers of a user's files: it keeps what reaches code that nothing reached before (Atheris).

``pip install '.[fuzz]'``, then ``python -m benchmarks.stability.fuzz FOLDER --seconds 600``. What ends as no reader may
stays in FOLDER with the error; so does what was kept, and the next run goes on from it.
"""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

INSTRUMENTED = ("smokelift", "tomllib", "zipfile", "json", "PIL", "numpy.lib")
"""What the readers run that is written in Python."""

LIMITS = ("-timeout=30", "-rss_limit_mb=4096", "-max_len=65536")
"""Seconds and MiB that one file may take, and its most bytes."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Fuzz readers one after the other, each in a process of its own; the status is 1 if any ends badly."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stability.fuzz", description=__doc__)
    parser.add_argument("folder", type=Path, help="for what is kept between runs, and what ends badly")
    parser.add_argument("--seconds", type=int, default=60, help="for every reader")
    parser.add_argument("--readers", nargs="+", metavar="READER", help="of benchmarks/stability/readers.py")
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.alone:
        fuzz(options.readers[0], options.folder, options.seconds)
    if importlib.util.find_spec("atheris") is None:
        parser.error("Atheris is missing: pip install '.[fuzz]'")
    from benchmarks.stability.readers import READERS

    failed = []
    for name in options.readers or READERS:
        words = [str(options.folder), "--seconds", str(options.seconds), "--readers", name, "--alone"]
        done = subprocess.run([sys.executable, "-m", "benchmarks.stability.fuzz", *words], stderr=subprocess.PIPE)
        said = done.stderr.decode(errors="replace").splitlines()
        runs = next((line.split()[1] for line in reversed(said) if line.startswith("Done ")), "?")
        print(f"{name}: {runs} files, {'sound' if done.returncode == 0 else 'FAILED'}", flush=True)
        if done.returncode:
            failed.append(name)
            print("\n".join(said[-30:]))
    return bool(failed)


def fuzz(name: str, folder: Path, seconds: int) -> None:
    """Fuzz one reader in this process, which ends with it."""
    import atheris

    with atheris.instrument_imports(include=list(INSTRUMENTED)):
        from benchmarks.stability.readers import READERS
    reader = READERS[name]
    place, kept = folder / name / "place", folder / name / "kept"
    for made in (place, kept):
        made.mkdir(parents=True, exist_ok=True)
    path = place / reader.name
    reader.write(path)
    (kept / "sound").write_bytes(path.read_bytes())

    def read(content: bytes) -> None:
        path.write_bytes(content)
        try:
            reader.read(path)
        except reader.error as error:
            assert "\n" not in str(error)

    found = f"-artifact_prefix={folder / name}/"
    atheris.Setup([sys.argv[0], str(kept), found, f"-max_total_time={seconds}", *LIMITS], read)
    atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
