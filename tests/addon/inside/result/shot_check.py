"""The check of a shot: when the engine reads the clip anew, and when what it said or reads stays good."""

import json
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

from addon.core.contract import QUALITIES
from addon.result import shot_check, side_job, smoke_takes
from tests.addon.inside.panel.tab import FIGURES, words
from tests.example_shot import smoke

FOUND = {"qualities": dict.fromkeys(QUALITIES, FIGURES), "background_color": [0.5, 0.6, 0.7]}
DONE = {"event": "done", "text": "Done.", **FOUND}
ENGINE = f"""
import sys, time
from pathlib import Path
with open(sys.argv[1], "a") as file:
    print("read", file=file)
time.sleep(float(sys.argv[2]))
Path(sys.argv[sys.argv.index("--page") + 1]).touch()
print({json.dumps(DONE)!r})
"""
"""Stands in for the engine, which reads for some seconds."""

CUT = ("before", "after", "first", "last")


@pytest.fixture(params=["30"])
def engine(request, shot, tmp_path, stand_in) -> Iterator[Path]:
    """The journal of an engine that reads for some seconds."""
    stand_in(side_job, ENGINE, str(tmp_path / "journal"), request.param)
    shot_check._known.clear()
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
    shot_check._start(obj, needs_page=True)
    before = job.job
    obj.smokelift.quality = "final"
    bpy.ops.smokelift.match_clip()
    shot_check._start(obj, needs_page=True)
    assert job.job is before
    obj.smokelift.use_medium = True
    shot_check._start(obj, needs_page=True)
    assert job.job is not before and before.outcome == "cancelled"


def test_a_reading_can_be_stopped(shot, engine) -> None:
    bpy.context.view_layer.update()
    shot_check.state.settings = shot_check.settings_text(smoke(shot))
    shot_check._start(smoke(shot), needs_page=True)
    job = shot_check.check_job.job
    assert "[stop_check]" in words(shot)
    assert bpy.ops.smokelift.stop_check() == {"FINISHED"}
    assert job.outcome == "cancelled" and shot_check.check_job.job is None
    texts = words(shot)
    assert "not estimated" in texts and "[stop_check]" not in texts and "[run]" in texts


@pytest.mark.parametrize("engine", ["0"], indirect=True)
def test_a_run_is_a_reading_too(shot, engine, tmp_path, stand_in) -> None:
    """Until a setting changes that matters; the page alone is made by a reading of its own."""
    said = [
        {"event": "note", "kind": "cut", "text": "A cut.", "doubt": True, "figures": dict.fromkeys(CUT, 1)},
        {"event": "start", "done": 0, "total": 6, **FOUND},
        {"event": "note", "kind": "empty frames", "text": "No smoke.", "doubt": True, "figures": {}},
    ]
    stand_in(smoke_takes, f"for line in {[json.dumps(message) for message in said]!r}: print(line)")
    state, obj = shot_check.state, smoke(shot)
    obj.smokelift.output = str(tmp_path)
    shot_check.state.settings = ""
    bpy.ops.smokelift.run()
    assert state.fits(obj) and state.done and [kind for kind, _ in state.doubts] == ["cut"]
    obj.smokelift.quality, obj.smokelift.seed = "final", 7
    assert state.fits(obj) and state.costs(obj)["final"] == FIGURES
    state.settings = ""
    shot_check.check(obj, needs_page=False)
    assert state.done and not engine.exists()
    bpy.ops.smokelift.check()
    assert engine.read_text() == "read\n" and Path(state.page).is_file()
    obj.smokelift.detail = 0.0
    shot_check.check(obj, needs_page=False)
    assert engine.read_text() == "read\n" * 2


def test_a_run_does_not_read_the_clip_beside_a_check(shot, engine, tmp_path, stand_in) -> None:
    stand_in(smoke_takes, "")
    smoke(shot).smokelift.output = str(tmp_path)
    shot_check._start(smoke(shot), needs_page=True)
    job = shot_check.check_job.job
    assert bpy.ops.smokelift.run() == {"FINISHED"}
    assert job.outcome == "cancelled" and shot_check.check_job.job is None
    assert not shot_check.state.fits(smoke(shot))
