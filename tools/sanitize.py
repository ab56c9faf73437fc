"""Run tests with a compiled core that checks itself: AddressSanitizer and UndefinedBehaviorSanitizer.

An access outside an array, a cast of what no integer can hold, or any other undefined behavior ends the run with
where it happened. By default the tests of transport, velocity and rendering run.

    .venv/bin/python tools/sanitize.py [PYTEST ARGUMENTS]
"""

import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
AREA = ROOT / "build" / "sanitized"

FLAGS = "-fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -fno-omit-frame-pointer -g"

TESTS = (
    "tests/engine/transport",
    "tests/engine/velocity",
    "tests/engine/render/test_renderer.py",
    "-k",
    "not memory",  # which the sanitizers take for themselves
)


def main(arguments: Sequence[str]) -> int:
    """Build the engine, and run tests with it; returns pytest's status."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(build()), str(ROOT)]),
        # Python itself is built without sanitizers, so they have to be there before it
        "LD_PRELOAD": " ".join(library(name) for name in ("libasan.so", "libubsan.so", "libstdc++.so")),
        "ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=1",
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *(arguments or TESTS)]
    return subprocess.run(words, cwd=ROOT, env=environment).returncode


def build() -> Path:
    """Build the engine with the sanitizers; a folder that holds its packages."""
    shutil.rmtree(AREA / "engine", ignore_errors=True)
    wheel = [
        sys.executable,
        "-m",
        "pip",
        "--disable-pip-version-check",
        "wheel",
        "--quiet",
        "--no-deps",
        "-w",
        str(AREA),
    ]
    wheel += ["-Cinstall.strip=false", "-Ccmake.build-type=RelWithDebInfo", f"-Cbuild-dir={AREA / 'core'}"]
    wheel += ["-w", str(AREA), str(ROOT)]
    subprocess.run(wheel, cwd=ROOT, env={**os.environ, "CXXFLAGS": FLAGS}, check=True)
    built = max(AREA.glob("smokelift-*.whl"), key=lambda file: file.stat().st_mtime)
    with zipfile.ZipFile(built) as archive:
        archive.extractall(AREA / "engine")
    return AREA / "engine"


def library(name: str) -> str:
    """Where the compiler keeps a library."""
    found = subprocess.run(
        [os.environ.get("CXX", "c++"), f"-print-file-name={name}"], capture_output=True, text=True, check=True
    )
    return found.stdout.strip()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
