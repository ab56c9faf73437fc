"""A measurement in a process of its own: clean thread pools, and a peak of memory that is its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from ctypes.util import find_library
from pathlib import Path

import smokelift


def run_module(module: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a module of this package with arguments, and keep what it prints."""
    return subprocess.run(
        [sys.executable, "-m", module, *arguments],
        env=environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )


def environment() -> dict[str, str]:
    """Return the variables of the process: it finds this package and smokelift, and Dr.Jit finds its compiler."""
    homes = [str(Path(__file__).parents[1]), str(Path(smokelift.__file__).parents[1])]
    paths = [*homes, *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**_llvm(), **os.environ, "PYTHONPATH": os.pathsep.join(paths), "JAX_PLATFORMS": "cpu"}


def why_it_ended(ended: subprocess.CompletedProcess[str]) -> str:
    """Return one sentence about a process that left no result."""
    status = ended.returncode
    if status == -signal.SIGKILL:
        return "Killed, most likely for lack of memory."
    if status < 0:
        return f"Crashed with {signal.Signals(-status).name}."
    return ((ended.stderr or "").strip().splitlines() or [f"Ended with status {status}."])[-1]


def finds_llvm() -> bool:
    """Whether Dr.Jit finds its compiler; without one it aborts the process."""
    return "DRJIT_LIBLLVM_PATH" in environment() or find_library("LLVM") is not None


def _llvm() -> dict[str, str]:
    """Dr.Jit takes any LLVM that it finds and crashes with old ones, so it gets the newest."""
    found = {
        int(path.name.split(".")[2]): str(path)
        for path in Path("/usr/lib").glob("*/libLLVM.so.*")
        if path.name.split(".")[2].isdigit()
    }
    return {"DRJIT_LIBLLVM_PATH": found[max(found)]} if found else {}
