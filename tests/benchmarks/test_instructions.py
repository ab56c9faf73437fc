"""The count of instructions where a machine has no counters."""

from __future__ import annotations

import subprocess
import sys

import pytest

from benchmarks.process import environment

COUNT = """
import os
from benchmarks.renderer.instructions import BEGIN, END, stepped

def work():
    for count in (10, 110):
        os.kill(os.getpid(), BEGIN)
        sum(range(count))
        os.kill(os.getpid(), END)

print(*stepped(work))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux lets a process step another one so")
def test_more_work_is_more_instructions() -> None:
    """Each of a hundred more additions takes some instructions, and not thousands."""
    ended = subprocess.run([sys.executable, "-c", COUNT], env=environment(), capture_output=True, text=True)
    if ended.returncode and "OSError" in ended.stderr:
        pytest.skip("the system lets no process trace its child")
    assert not ended.returncode, ended.stderr
    few, more = map(int, ended.stdout.split())
    assert 5 * 100 < more - few < 500 * 100
