"""One run of the engine as a process."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import smokelift
from smokelift.batch.engine import ENGINE, run_engine

PYTHON = (sys.executable, "-c")


def test_what_is_no_message_is_told_of_one_that_ends_by_itself(tmp_path) -> None:
    code = "import sys; print('loading', flush=True); print('no such thing', file=sys.stderr); sys.exit(5)"
    ended = run_engine([], threading.Event(), tmp_path / "log", (*PYTHON, code))
    assert (ended.status, ended.sentence) == (5, "The engine ended by itself (status 5): no such thing")
    assert "no such thing" in (tmp_path / "log").read_text()


def test_a_log_that_cannot_be_written_stops_nothing(tmp_path) -> None:
    code = """print('{"event": "done", "text": "Made.", "frames": 3}')"""
    ended = run_engine([], threading.Event(), tmp_path / "no" / "log", (*PYTHON, code))
    assert (ended.status, ended.sentence, ended.details["frames"], ended.retryable) == (0, "Made.", 3, False)


def test_the_real_command_ends_when_its_standard_input_closes() -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(smokelift.__file__).parents[1])}
    command = [*ENGINE, "reconstruct", "/dev/null", "--out", "never"]
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, env=environment, check=False, timeout=60
    )
    assert done.returncode == 130
    assert done.stderr.endswith(b"Cancelled.\n")
