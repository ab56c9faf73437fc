"""A measurement in a process of its own: clean thread pools, and a peak of memory that is its own."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from ctypes.util import find_library
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

Made = TypeVar("Made")


def apart(work: Callable[..., Made], *arguments: object) -> Made | str:
    """Return what a function returns in a process of its own, or one sentence that says why there is nothing.

    What the process prints is not shown.
    """
    for name, value in _llvm().items():
        os.environ.setdefault(name, value)
    with ProcessPoolExecutor(1, get_context("spawn"), _be_silent) as process:
        try:
            return process.submit(work, *arguments).result()
        except BrokenProcessPool:
            return "Crashed, or was killed, most likely for lack of memory."
        except MemoryError as error:
            return str(error) or "Out of memory."
        except Exception as error:  # whatever a framework raises, the others go on
            return (str(error).strip().splitlines() or [type(error).__name__])[-1]


def finds_llvm() -> bool:
    """Whether Dr.Jit finds its compiler; without one it aborts the process."""
    return "DRJIT_LIBLLVM_PATH" in {**os.environ, **_llvm()} or find_library("LLVM") is not None


def _be_silent() -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)


def _llvm() -> dict[str, str]:
    """Dr.Jit takes any LLVM that it finds and crashes with old ones, so it gets the newest."""
    found = {
        int(path.name.split(".")[2]): str(path)
        for path in Path("/usr/lib").glob("*/libLLVM.so.*")
        if path.name.split(".")[2].isdigit()
    }
    return {"DRJIT_LIBLLVM_PATH": found[max(found)]} if found else {}
