"""``python -m benchmarks pipeline``: what is timed, the table, and what is refused."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.command import main
from benchmarks.pipeline import clip, run
from benchmarks.pipeline.clip import with_grid, write_clip
from benchmarks.pipeline.table import text
from benchmarks.pipeline.worker import Job, Run, measure
from benchmarks.velocity.flow import built_in_densities, built_in_pair
from smokelift.output.vdb import VdbUnavailable, vdb_module

SHAPE = (16, 16, 24)


@pytest.fixture
def small_pictures(monkeypatch):
    monkeypatch.setattr(clip, "PIXELS", (48, 72))
    monkeypatch.setattr(clip, "SHAPE", SHAPE)


def test_the_built_in_smoke_moves_as_its_formula_says():
    pair = built_in_pair(SHAPE, 0)
    first, second = built_in_densities(SHAPE, 0, 2)
    np.testing.assert_array_equal(first, pair.before)
    assert np.linalg.norm(second - pair.after) < 0.02 * np.linalg.norm(pair.after - pair.before)


def test_the_box_has_cubes_of_any_number_about_the_same_middle(tmp_path, small_pictures):
    scene = write_clip(tmp_path, 1)
    for shape in (SHAPE, (32, 32, 36)):
        box = with_grid(scene, shape).domain
        assert box is not None and box.resolution == shape
        assert box.centre == (0.0, 0.0, 0.0)
        assert box.max[2] - box.min[2] == pytest.approx(clip.HEIGHT)


@pytest.mark.usefixtures("small_pictures")
def test_a_run_is_timed_in_a_process_of_its_own(tmp_path, capsys):
    try:
        vdb_module()
    except VdbUnavailable as missing:
        pytest.skip(str(missing))
    status = main([*("pipeline", "--sizes", "16x16x24", "--frames", "1"), "--json", str(tmp_path / "found.json")])
    assert status == 0
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["clip"] == "built-in"
    (only,) = found["runs"]
    assert only["failure"] == "" and only["size"] == list(SHAPE)
    assert 0 < only["seconds_density"] + only["seconds_velocity"] <= only["seconds"]
    assert only["solves"] > 0 and only["psnr"] > 30
    assert "16x16x24, default" in capsys.readouterr().out


@pytest.mark.usefixtures("small_pictures")
def test_the_first_frames_are_not_clocked(tmp_path, monkeypatch):
    taken: list[tuple[int, int]] = []

    def frames(source, *_):
        taken.append(source.frames)
        raise ValueError("enough")

    monkeypatch.setattr("benchmarks.pipeline.worker.Clip.open", frames)
    scene = with_grid(write_clip(tmp_path, 1), SHAPE)
    assert scene.clip is not None
    replace(scene, clip=replace(scene.clip, frames=(3, 9))).save(tmp_path / "scene.toml")
    with pytest.raises(ValueError, match="enough"):
        measure(Job(str(tmp_path / "scene.toml"), SHAPE, "default", "balanced", 4))
    assert taken == [(3, 8)]


def test_what_failed_is_said_and_the_others_go_on(tmp_path, monkeypatch):
    outcomes = iter(
        [Run((8, 8, 8), "default", failure="Out of memory."), Run((9, 9, 9), "default", 2.0, 1.0, 0.9, 5.0)]
    )
    monkeypatch.setattr(run, "run_apart", lambda *_: next(outcomes))
    monkeypatch.setattr(run, "write_clip", lambda *_: None)
    monkeypatch.setattr(run, "with_grid", lambda *_: _Unsaved())
    said: list[str] = []
    results = run.run(None, [(8, 8, 8), (9, 9, 9)], ["default"], "balanced", 1, said.append, lambda _: None)
    assert said == ["8x8x8, default: Out of memory.", "9x9x9, default: 2 s a frame, 5 solves"]
    assert "8x8x8, default: Out of memory." in text(results)


class _Unsaved:
    def save(self, path: Path) -> None: ...


def test_the_papers_times_stand_beside_ours():
    row = asdict(Run((64, 64, 96), "default", 1.5, 0.5, 0.9, 150.0, 400.0, 50.0))
    results = {
        "machine": {"processor": "some", "cores": 2},
        "date": "today",
        "versions": {},
        "clip": "built-in",
        "quality": "fine",
        "runs": [row],
    }
    assert "0.08 / 6.13" in text(results)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--methods", "best"], "expected some of default, paper"),
        (["--frames", "0"], "expected a number of frames"),
        (["--sizes", "8x8x8"], "none below 16"),
    ],
)
def test_what_cannot_be_timed_is_refused(arguments, expected, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["pipeline", *arguments])
    assert ended.value.code == 2
    assert expected in capsys.readouterr().err


def test_a_scene_that_is_not_there_is_one_sentence(tmp_path, capsys):
    assert main(["pipeline", str(tmp_path / "none.toml")]) == 2
    assert "none.toml" in capsys.readouterr().err
