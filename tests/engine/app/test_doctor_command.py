"""``smokelift doctor``: what it says of this machine."""

from __future__ import annotations

import subprocess

from command_line import ENVIRONMENT, MODULE, command, events

import smokelift
from smokelift.render import device


def test_doctor_in_a_process_of_its_own() -> None:
    """Versions, devices and what is missing, on standard output; nothing on the other."""
    done = subprocess.run([*MODULE, "doctor"], env=ENVIRONMENT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith(f"smokelift {smokelift.__version__}, Python 3.")
    for word in ("libraries: numpy ", "taichi ", "processor core", "GiB free", "GPU: ", "OpenVDB"):
        assert word in done.stdout
    assert done.stderr == ""


def test_doctor_without_taichi(capsys, monkeypatch) -> None:
    """A GPU that is not used for lack of it is said, with what to install."""
    monkeypatch.setattr(device, "has_taichi", lambda: False)
    monkeypatch.setattr(device, "driver_installed", lambda: True)
    monkeypatch.setattr(device, "_running", "cpu")
    assert command("doctor") == 0
    assert "GPU: not used, as Taichi is not installed: install it (pip" in capsys.readouterr().out


def test_doctor_as_json(capsys) -> None:
    """Programs get the same lines as notes."""
    assert command("doctor", "--progress", "json") == 0
    sent = events(capsys.readouterr().out)
    assert {event["event"] for event in sent} == {"note"}
    assert any(event["text"].startswith("GPU:") for event in sent)
