"""The core's worker threads are kept from call to call, whatever a process does meanwhile."""

import os
import signal
import threading
from collections.abc import Callable

import numpy as np
import pytest

from smokelift import _core
from smokelift.transport import face_shapes

FACES = tuple(np.random.default_rng(0).random(shape, np.float32) for shape in face_shapes((33, 16, 16)))
"""Enough slabs for every thread, and so few voxels that a call is short."""


def test_calls_at_the_same_time_have_threads_of_their_own() -> None:
    _core.set_threads(3)
    expected, wrong = _core.divergence(FACES), []

    def call() -> None:
        wrong.extend(n for n in range(300) if not np.array_equal(_core.divergence(FACES), expected))

    callers = [threading.Thread(target=call) for _ in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert not wrong


forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="This system cannot fork.")


@forks
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_fork_computes_as_its_parent_does_even_amid_a_call() -> None:
    _core.set_threads(2)
    expected, ended = _core.divergence(FACES), threading.Event()

    def call() -> None:
        while not ended.is_set():
            _core.divergence(FACES)

    def same() -> bool:
        return all(np.array_equal(_core.divergence(FACES), expected) for _ in range(2))

    caller = threading.Thread(target=call)
    caller.start()
    try:
        assert [_status_of_fork(same) for _ in range(20)] == [0] * 20
    finally:
        ended.set()
        caller.join()


@forks
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_where_the_system_gives_no_thread_one_does_all_the_work() -> None:
    import resource  # which Windows lacks

    expected = _core.divergence(FACES)

    def same() -> bool:
        if os.getuid() == 0:
            os.setuid(54321)  # root may have any number
        resource.setrlimit(resource.RLIMIT_NPROC, (1, 1))
        _core.set_threads(4)
        return np.array_equal(_core.divergence(FACES), expected)

    assert _status_of_fork(same) == 0


def _status_of_fork(work: Callable[[], bool]) -> int:
    """0 if a child finds that something is so; the signal that ends it if it hangs."""
    child = os.fork()
    if child == 0:
        signal.alarm(10)
        try:
            os._exit(not work())
        finally:
            os._exit(1)
    return os.waitpid(child, 0)[1]
