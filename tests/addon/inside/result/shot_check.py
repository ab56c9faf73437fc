"""The check of a shot: when the engine reads the clip anew, and when what it said or reads stays good."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

from addon.core.contract import QUALITIES
from addon.result import run_queue, shot_check, side_job
from tests.addon.inside.panel.tab import words
from tests.example_shot import smoke

FIGURES = {"resolution": [48, 48, 64], "seconds": 12, "memory": 2**28, "memory_free": 2**33, "disk": 3e7, "lost": 0.1}
DONE = {"event": "done", "text": "Done.", **FIGURES, "qualities": dict.fromkeys(QUALITIES, FIGURES)}
ENGINE = f"""
import sys, time
with open(sys.argv[1], "a") as file:
    print("read", file=file)
time.sleep(float(sys.argv[2]))
print({json.dumps(DONE)!r})
"""
"""Stands in for the engine, which reads for some seconds."""


@pytest.fixture(params=["30"])
def engine(request, shot, tmp_path, monkeypatch) -> Iterator[Path]:
    """The journal of an engine that reads for some seconds."""
    command = [sys.executable, "-c", ENGINE, str(tmp_path / "journal"), request.param]
    monkeypatch.setattr(side_job, "engine_command", lambda words: [*command, *words])
    monkeypatch.setattr(shot_check, "_known", {})
    yield tmp_path / "journal"
    shot_check.check_job.stop()


@pytest.mark.parametrize("engine", ["0"], indirect=True)
def test_another_quality_is_known_and_another_shot_is_read(shot, engine) -> None:
    state, settings = shot_check.state, smoke(shot).smokelift
    for quality in QUALITIES:
        settings.quality = quality
        bpy.ops.smokelift.check()
        assert state.done and not state.error
        assert list(state.costs(smoke(shot))) == list(QUALITIES)
    assert engine.read_text() == "read\n"
    settings.albedo, settings.use_medium = 0.5, True
    assert not state.fits(smoke(shot))
    bpy.ops.smokelift.check()
    assert state.done and engine.read_text() == "read\n" * 2


def test_a_reading_of_the_same_shot_goes_on(shot, engine) -> None:
    obj, job = smoke(shot), shot_check.check_job
    shot_check._start(obj)
    before = job.job
    obj.smokelift.quality = "final"
    bpy.ops.smokelift.match_clip()
    shot_check._start(obj)
    assert job.job is before
    obj.smokelift.use_medium = True
    shot_check._start(obj)
    assert job.job is not before and before.outcome == "cancelled"


def test_a_reading_can_be_stopped(shot, engine) -> None:
    bpy.context.view_layer.update()
    shot_check.state.settings = shot_check.settings_text(smoke(shot))
    shot_check._start(smoke(shot))
    job = shot_check.check_job.job
    assert "[stop_check]" in words(shot)
    assert bpy.ops.smokelift.stop_check() == {"FINISHED"}
    assert job.outcome == "cancelled" and shot_check.check_job.job is None
    texts = words(shot)
    assert "not estimated" in texts and "[stop_check]" not in texts and "[run]" in texts


def test_a_run_does_not_read_the_clip_beside_a_check(shot, engine, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(run_queue, "engine_command", lambda words: [sys.executable, "-c", ""])
    smoke(shot).smokelift.output = str(tmp_path)
    shot_check._start(smoke(shot))
    job = shot_check.check_job.job
    assert bpy.ops.smokelift.run() == {"FINISHED"}
    assert job.outcome == "cancelled" and shot_check.check_job.job is None
    assert not shot_check.state.fits(smoke(shot))
