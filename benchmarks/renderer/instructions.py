"""Count the instructions of every compiled step of an iteration, and how many the processor does in a nanosecond.

    python -m benchmarks.renderer.instructions --size 16

Virtual machines seldom have counters. So a child process does an iteration while this one lets it go instruction by
instruction (ptrace; Linux only), some ten thousand a second: take small sizes. Their arrays lie in caches, where
instructions are what takes time. The times are of another, free run.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import signal
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

import smokelift._core as _core
from benchmarks.renderer.peers import ours
from benchmarks.renderer.roofline import BYTES, measure
from benchmarks.renderer.scene import bench_scene, plume
from benchmarks.tables import markdown, number

TRACE_ME, GO_ON, STEP = 0, 7, 9
"""Requests of ptrace, from <sys/ptrace.h>."""

BEGIN, END = signal.SIGUSR1, signal.SIGUSR2
"""What the child sends itself around a step; the tracer keeps them from arriving."""


class Announced:
    """The compiled module, with a signal before and after each of its steps."""

    def __getattr__(self, name: str) -> Any:
        """Return a step that announces itself, and anything else as it is."""
        found = getattr(_core, name)
        return self._announced(found) if name in BYTES else found

    def _announced(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def announced(*arguments: Any) -> Any:
            os.kill(os.getpid(), BEGIN)
            result = work(*arguments)
            os.kill(os.getpid(), END)
            return result

        return announced


def count(size: int) -> dict[str, int]:
    """Return the instructions of every step of an iteration; the interpreter's few thousand around it are among them.

    Raises
    ------
    OSError
        If the system does not let a process trace its child.
    """
    scene = bench_scene(plume(size, 1.0), np.full((size, size, 3), 0.3, np.float32))
    iteration = ours.prepare(scene)
    iteration.run(scene.density)  # takes the memory

    def in_child() -> None:
        import_module("smokelift.render.cpu_backend")._core = Announced()  # type: ignore[attr-defined]
        iteration.run(scene.density)

    counts = stepped(in_child)
    return dict(zip(BYTES, counts, strict=True))


def stepped(work: Callable[[], None]) -> list[int]:
    """Do some work in a child process, and return the instructions between each `BEGIN` and `END`."""
    ptrace = ctypes.CDLL(None, use_errno=True).ptrace
    ptrace.argtypes, ptrace.restype = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p], ctypes.c_long
    child = os.fork()
    if not child:
        status = 1
        try:
            if ptrace(TRACE_ME, 0, None, None) == 0:
                os.kill(os.getpid(), signal.SIGSTOP)
                work()
                status = 0
        finally:
            os._exit(status)
    counts: list[int] = []
    stepping, steps = False, 0
    _, state = os.waitpid(child, 0)
    while os.WIFSTOPPED(state):
        stop = os.WSTOPSIG(state)
        passed_on = 0
        if stop == signal.SIGTRAP:
            steps += 1
        elif stop == BEGIN:
            stepping, steps = True, 0
        elif stop == END:
            stepping = False
            counts.append(steps)
        elif stop != signal.SIGSTOP:
            passed_on = stop
        if ptrace(STEP if stepping else GO_ON, child, None, passed_on) < 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        _, state = os.waitpid(child, 0)
    if os.waitstatus_to_exitcode(state):
        raise OSError("the traced process failed; does the system allow ptrace?")
    return counts


def main() -> None:
    """Count, measure, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.renderer.instructions")
    parser.add_argument("--size", type=int, default=16)
    size = parser.parse_args().size
    _core.set_threads(1)
    counts = count(size)
    times, _ = measure(size)
    rows = []
    for name in [*BYTES, "all"]:
        done = sum(counts.values()) if name == "all" else counts[name]
        spent = sum(times.values()) if name == "all" else times[name]
        rows.append([name, number(done / size**3), number(spent), number(done / size**3 / spent)])
    print(markdown(["step", f"instructions a voxel, {size}^3", "ns a voxel", "instructions a ns"], rows))


if __name__ == "__main__":
    main()
