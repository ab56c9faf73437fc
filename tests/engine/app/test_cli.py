"""The exit status of everything else that ends a command: device, memory, and being cancelled."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from command_line import ENVIRONMENT, MODULE, QUICK, command, events, events_of, names, refused

import smokelift
from smokelift.output.index import work_seconds
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.render import device


def test_a_gpu_that_is_not_there(shot, tmp_path) -> None:
    if device.available_gpu() in ("cuda", "metal"):
        pytest.skip("there is a GPU here that cannot be hidden")
    done = subprocess.run(
        [*MODULE, "reconstruct", str(shot), "--out", str(tmp_path / "out"), "--device", "gpu"],
        env={**ENVIRONMENT, "VK_DRIVER_FILES": "/none", "VK_ICD_FILENAMES": "/none"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 3
    assert done.stderr.startswith("No GPU")
    assert "choose cpu as the device" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_grid_too_large_for_the_memory(plume, tmp_path, capsys) -> None:
    clip = str(plume.scene.clip.path)
    words = ("--out", tmp_path / "out", "--npz", "--resolution", "4000,4000,4000", *QUICK)
    sentence = refused(capsys, "reconstruct", clip, *words, status=3)
    assert re.search(r"resolution that fits is \d+,\d+,\d+", sentence)
    assert not (tmp_path / "out").exists()


def test_a_cancelled_run_can_be_resumed(shot, tmp_path, monkeypatch, capsys) -> None:
    """In a folder that is named as people type it."""
    monkeypatch.chdir(tmp_path)
    words, write = ("reconstruct", shot, "--out", "out", "--npz", "--progress", "json", *QUICK), SequenceWriter.write

    def cancelled(writer: SequenceWriter, number: int, *given: Any, **named: Any) -> None:
        write(writer, number, *given, **named)
        if number == 2:
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(SequenceWriter, "write", cancelled)
        assert command(*words) == 130
    said = capsys.readouterr()
    last = events(said.out)[-1]
    assert (last["event"], last["status"], said.err) == ("error", 130, "")
    assert "--resume" in last["text"]
    assert Sequence.open(tmp_path / "out").frames == (1, 2)
    assert not [name for name in names(tmp_path / "out") if name.endswith(".tmp") or name == "run.lock"]
    sent = events_of(capsys, *words, "--resume")
    start = next(event for event in sent if event["event"] == "start")
    assert (start["done"], start["total"]) == (2, 5) and start["seconds_left"] > 0
    whole_run = Sequence.open(tmp_path / "out")
    assert whole_run.frames == tuple(range(1, 6))
    assert sent[-1]["seconds"] > sum(map(work_seconds, map(whole_run.figures, whole_run.frames)))


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs Linux to count threads")
def test_the_command_loads_no_threads_of_openblas() -> None:
    script = (
        "import smokelift_command, sys; sys.argv = ['smokelift', 'doctor', '--help']\n"
        "try: smokelift_command.main()\n"
        "except SystemExit: print(open('/proc/self/status').read())"
    )
    unset = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    said = subprocess.run([sys.executable, "-c", script], env=unset, capture_output=True, text=True, check=True).stdout
    assert "Threads:\t1\n" in said


def test_threads_are_limited(tmp_path, capsys, monkeypatch) -> None:
    given: list[int] = []
    monkeypatch.setattr("smokelift.app.cli.set_threads", given.append)
    assert command("doctor", "--threads", 2) == 0
    assert command("doctor") == 0
    assert given == [2, 0]
    assert command("doctor", "--threads", "many") == 2
    assert "whole number from 0 to 1024" in capsys.readouterr().err


def test_doctor_lists_what_is_there_and_what_is_missing(capsys, monkeypatch) -> None:
    assert command("doctor") == 0
    said = capsys.readouterr()
    assert said.out.startswith(f"smokelift {smokelift.__version__}, Python 3.") and said.err == ""
    for word in ("libraries: numpy ", "taichi ", "processor core", "GiB free", "GPU: ", "OpenVDB"):
        assert word in said.out
    monkeypatch.setattr(device, "has_taichi", lambda: False)
    monkeypatch.setattr(device, "driver_installed", lambda: True)
    monkeypatch.setattr(device, "_running", "cpu")
    assert command("doctor") == 0
    assert "GPU: not used, as Taichi is not installed: install it (pip" in capsys.readouterr().out
