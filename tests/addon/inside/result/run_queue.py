"""The queue of runs: one after the other, whatever becomes of each."""

import sys
from unittest.mock import Mock

import bpy
import pytest

from addon.core import ShotError
from addon.core.job import Job
from addon.core.take import Take, takes
from addon.result import run_queue, smoke_takes
from addon.result.smoke_takes import Run, runs
from addon.scene import volume
from addon.scene.smoke import find_smoke, new_smoke
from conftest import made

ENGINE = """
import json, sys
from pathlib import Path
journal, out = Path(sys.argv[1]), sys.argv[sys.argv.index("--out") + 1]
with journal.open("a") as file:
    print("begin", out, file=file, flush=True)
    if out.endswith("2"):
        print(json.dumps({"event": "error", "text": "No clip."}), flush=True)
        sys.exit(2)
    print(json.dumps({"event": "done", "text": "Done."}), flush=True)
    print("end", out, file=file, flush=True)
"""
"""Stands in for the engine: the second run fails."""


def queued(obj: bpy.types.Object, count: int, engine: str = "", *words: str) -> list[Take]:
    """Takes of a smoke that wait for a script in the engine's place."""
    written = []
    for _ in range(count):
        take = smoke_takes.write_take(obj)
        command = [sys.executable, "-c", engine, *words, *take.arguments()]
        runs.append(Run(take, obj.session_uid, Job(command, take.log_file), (0, False)))
        written.append(take)
    return written


FRAMES = """
import json
for message in (
    {"event": "start", "done": 0, "total": 6},
    {"event": "frame", "frame": 6, "done": 6, "total": 6, "seconds_left": 0.0},
    {"event": "done", "text": "Done."},
):
    print(json.dumps(message), flush=True)
"""
"""Stands in for an engine whose frames are there already."""


def test_the_frame_stays_where_another_smoke_gets_its_first_result(scene, clip, tmp_path) -> None:
    other, active = new_smoke(scene, clip), new_smoke(scene, clip)
    for obj, frame in ((other, 40), (active, 2)):
        obj.smokelift.output = str(tmp_path / obj.name)
        (take,) = queued(obj, 1, FRAMES)
        made(take.directory.parent)
        obj.smokelift.camera_mode = "SCENE"  # of which these files have none
        scene.frame_set(40)
        run_queue.work()
        assert volume.shown_take(obj) == take
        assert scene.frame_current in ((frame,) if frame == 40 else (1, 2))


@pytest.fixture
def obj(scene, clip, tmp_path) -> bpy.types.Object:
    """A smoke whose takes lie in a folder of their own."""
    obj = new_smoke(scene, clip)
    obj.smokelift.output = str(tmp_path / "takes")
    return obj


def test_runs_follow_one_another_and_a_failed_one_stops_none(obj, tmp_path) -> None:
    journal = tmp_path / "journal"
    written = queued(obj, 3, ENGINE, str(journal))
    run_queue.work()
    found = [(run.job.outcome, run.job.sentence) for run in runs]
    assert found == [("done", "Done."), ("failed", "No clip."), ("done", "Done.")]
    first, second, third = (take.directory for take in written)
    wanted = [f"begin {first}", f"end {first}", f"begin {second}", f"begin {third}", f"end {third}"]
    assert journal.read_text().splitlines() == wanted


def test_a_deleted_smoke_is_made_no_more(scene, obj) -> None:
    (take,) = queued(obj, 1)
    scene.collection.objects.unlink(obj)
    assert find_smoke(obj.session_uid) is None
    run_queue.work()
    assert runs[0].job.outcome == "cancelled"
    assert take.read().resumable


def test_a_run_that_is_taken_out_of_the_queue_leaves_nothing(obj, tmp_path) -> None:
    first, second, third = queued(obj, 3, "import sys; sys.stdin.read()")
    running = runs[0].job
    running.start()
    assert bpy.ops.smokelift.cancel(take=str(second.directory)) == {"FINISHED"}
    assert [run.take for run in runs] == takes(tmp_path / "takes") == [first, third]
    assert bpy.ops.smokelift.cancel() == {"FINISHED"}
    assert running.stopping and [run.job.outcome for run in runs] == ["running", "waiting"]
    running.kill()


def test_what_cannot_be_started_is_not_queued(obj, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(smoke_takes, "engine_command", Mock(side_effect=ShotError("It is missing.")))
    with pytest.raises(RuntimeError, match="missing"):
        bpy.ops.smokelift.run()
    assert runs == takes(tmp_path / "takes") == []
