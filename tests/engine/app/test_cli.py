"""The exit status of everything else that ends a command: device, memory, and being cancelled."""

import gc
import json
import os
import re
import signal
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import ENVIRONMENT, MODULE, QUICK, command, events, names, refused

import smokelift
from smokelift.app.progress import work_seconds
from smokelift.output.sequence import Sequence
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


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT to send")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_cancelled_run_can_be_resumed(plume, tmp_path, monkeypatch, capsys, number) -> None:
    heights = np.linspace(0.3, 0.9, 8)
    filmed = plume.write(tmp_path / "clip", [plume.blob(plume.scene, height) for height in heights])
    filmed.save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    # paths relative to the working directory are what people type
    monkeypatch.chdir(tmp_path)
    words = ["reconstruct", "scene.toml", "--npz", "--progress", "json", *QUICK]
    with subprocess.Popen(
        [*MODULE, *words, "--out", "out"],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # a test run in the background may ignore SIGINT, which children inherit
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        sent = []
        for line in process.stdout:
            sent.append(json.loads(line))
            if sent[-1]["event"] == "frame":
                process.send_signal(number)
                break
        sent += events(process.stdout.read())
        errors = process.stderr.read()
        assert process.wait(60) == 130
    assert "KeyboardInterrupt" not in errors
    assert (sent[-1]["event"], sent[-1]["status"]) == ("error", 130)
    assert "--resume" in sent[-1]["text"]
    begun = Sequence.open(out)
    assert 1 <= len(begun.frames) < 8
    assert not [name for name in names(out) if name.endswith(".tmp") or name == "run.lock"]
    assert command(*words, "--out", "out", "--resume") == 0
    sent = events(capsys.readouterr().out)
    start = next(event for event in sent if event["event"] == "start")
    assert (start["done"], start["total"]) == (len(begun.frames), 8)
    whole_run = Sequence.open(out)
    assert whole_run.frames == tuple(range(1, 9))
    assert sent[-1]["seconds"] > sum(map(work_seconds, map(whole_run.figures, whole_run.frames)))
    assert start["seconds_left"] > 0
    assert command("reconstruct", tmp_path / "scene.toml", "--out", tmp_path / "whole", "--npz", *QUICK) == 0
    for path in sorted((tmp_path / "whole").glob("*.npz")):
        with np.load(path) as whole, np.load(out / path.name) as resumed:
            for name in whole.files:
                np.testing.assert_array_equal(resumed[name], whole[name], err_msg=f"{path.name} {name}")


def test_an_interrupt_while_writing_is_quiet(shot, tmp_path, capsys, monkeypatch) -> None:
    cries: list[Any] = []
    opened = []
    real = zipfile.ZipFile.open

    def interrupted(archive: zipfile.ZipFile, name: Any, mode: Any = "r", *rest: Any, **options: Any) -> Any:
        if mode == "w":
            opened.append(name)
            if len(opened) == 11:  # within the second frame's files
                raise KeyboardInterrupt
        return real(archive, name, mode, *rest, **options)

    with monkeypatch.context() as patch:
        patch.setattr(sys, "unraisablehook", cries.append)
        patch.setattr(zipfile.ZipFile, "open", interrupted)
        sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--npz", *QUICK, status=130)
        gc.collect()
    assert sentence.startswith("Cancelled")
    assert "--resume" in sentence
    assert Sequence.open(tmp_path / "out").frames == (1,)
    assert not [name for name in names(tmp_path / "out") if name.endswith(".tmp")]
    assert command("reconstruct", shot, "--out", tmp_path / "out", "--npz", "--resume", *QUICK) == 0
    assert [cry.exc_value for cry in cries] == []


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


def test_doctor_in_a_process_of_its_own() -> None:
    done = subprocess.run([*MODULE, "doctor"], env=ENVIRONMENT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith(f"smokelift {smokelift.__version__}, Python 3.")
    for word in ("libraries: numpy ", "taichi ", "processor core", "GiB free", "GPU: ", "OpenVDB"):
        assert word in done.stdout
    assert done.stderr == ""


def test_doctor_without_taichi(capsys, monkeypatch) -> None:
    monkeypatch.setattr(device, "has_taichi", lambda: False)
    monkeypatch.setattr(device, "driver_installed", lambda: True)
    monkeypatch.setattr(device, "_running", "cpu")
    assert command("doctor") == 0
    assert "GPU: not used, as Taichi is not installed: install it (pip" in capsys.readouterr().out
