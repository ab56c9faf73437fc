"""``python -m benchmarks velocity``: the figures, the table and what is refused."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import machine
from benchmarks.command import main
from benchmarks.velocity import run
from benchmarks.velocity.flow import built_in_pair
from benchmarks.velocity.table import estimate_name
from smokelift.transport import Velocity

SHAPE = (16, 16, 24)
FRAMES = 6
PLAN = run.Plan(
    pairs=1, iterations=(1, 10), primal_dual_iterations=(3,), others=({"linearisations": 1}, {"method": "paper"})
)

FEW = run.Plan(pairs=1, iterations=(1,), primal_dual_iterations=(), others=())


@pytest.fixture
def quick(monkeypatch):
    """Little is measured, and once."""
    monkeypatch.setattr(run, "USUAL", PLAN)
    monkeypatch.setattr(run, "MAX_RUNS", 1)


@pytest.fixture
def idle(monkeypatch):
    """Nothing may be measured."""
    monkeypatch.setattr(run, "CoarseToFine", None)


def write_truth(path: Path, shape=SHAPE, frames: int = FRAMES, **changes: object) -> Path:
    """Smoke that rises one voxel a frame as a whole, in a file like those of baked scenes."""
    smoke = built_in_pair(shape, 0).before
    faces = Velocity.zero(shape, 0.1).faces
    faces[2][:] = 0.1 * 24
    arrays = {
        "density": np.stack([np.roll(smoke, frame, axis=2) for frame in range(frames)]).astype(np.float16),
        **{f"velocity_{axis}": np.stack([face] * frames) for axis, face in zip("xyz", faces, strict=True)},
        "inflow_packed": np.zeros((frames, int(np.prod(shape)) // 8), np.uint8),
        "voxel_size": 0.1,
        "fps": 24.0,
    } | changes
    path.parent.mkdir(exist_ok=True)
    np.savez(path, **arrays)
    return path


def bench(*words: object) -> int:
    try:
        return main(["velocity", *map(str, words)])
    except SystemExit as leaving:
        assert isinstance(leaving.code, int)
        return leaving.code


def test_every_figure_in_json_and_in_the_table(quick, tmp_path, capsys):
    path = tmp_path / "bench.json"
    assert bench("--sizes", "20x16x24,16x16x24", "--json", path) == 0
    results = json.loads(path.read_text())
    assert results["machine"]["cores"] > 0
    assert results["versions"]["numpy"] == np.__version__
    assert "scipy" in results["versions"]
    assert results["date"].startswith("20")
    assert [row["size"] for row in results["sizes"]] == [[16, 16, 24], [20, 16, 24]]
    for row in results["sizes"]:
        assert row["scene"] == "built-in"
        assert row["poisson_ms"] > 0
        assert 0 < row["voxels_a_frame"] < 1
        estimates = {(row["setting"], row["value"]): row for row in row["estimates"]}
        assert list(estimates) == [
            ("iterations", 1),
            ("iterations", 10),
            ("primal_dual_iterations", 3),
            ("linearisations", 1),
            ("method", "paper"),
        ]
        assert [row["default"] for row in estimates.values()] == [False, True, False, False, False]
        assert len({row["error"] for row in estimates.values()}) == 5
        for estimate in estimates.values():
            assert 0 < estimate["error"] < 1
            assert estimate["errors"] == [estimate["error"]]
        for timed in estimates.values():
            assert timed["seconds"] > 0
            assert timed["solves"] > 0
    table = capsys.readouterr().out
    for name in (
        "16x16x24, built-in",
        "20x16x24, built-in",
        "10 iterations *",
        "3 primal-dual steps",
        "1 linearisation ",
    ):
        assert name in table


def test_more_iterations_are_nearer_to_the_truth(monkeypatch):
    monkeypatch.setattr(run, "USUAL", replace(FEW, pairs=2, iterations=(1, 20)))
    monkeypatch.setattr(run, "MAX_RUNS", 1)
    (row,) = run.run([(32, 32, 48)], [], lambda _: None, lambda _: None)["sizes"]
    errors = [estimate["error"] for estimate in row["estimates"]]
    assert errors[1] < 0.9 * errors[0]
    assert errors[1] < 0.5
    assert [len(estimate["errors"]) for estimate in row["estimates"]] == [2, 2]


def test_known_scenes_take_the_place_of_the_built_in_one_at_their_size(quick, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(run, "USUAL", FEW)
    truth, path = write_truth(tmp_path / "plume-9" / "truth.npz"), tmp_path / "bench.json"
    assert bench(truth, "--sizes", "16x16x24,16x16x32", "--json", path) == 0
    known, built_in = json.loads(path.read_text())["sizes"]
    assert (known["scene"], built_in["scene"]) == ("plume-9", "built-in")
    assert known["voxels_a_frame"] == pytest.approx(1, rel=1e-3)
    assert "16x16x24, plume-9" in capsys.readouterr().out


def test_results_so_far_stay_when_the_rest_is_cancelled(quick, tmp_path, monkeypatch):
    path = tmp_path / "bench.json"

    def until_the_second_size(shape, seed):
        if shape != SHAPE:
            raise KeyboardInterrupt
        return built_in_pair(shape, seed)

    monkeypatch.setattr(run, "USUAL", FEW)
    monkeypatch.setattr(run, "built_in_pair", until_the_second_size)
    assert bench("--sizes", "16x16x24,16x16x32", "--json", path) == 130
    assert [row["size"] for row in json.loads(path.read_text())["sizes"]] == [[16, 16, 24]]


def test_a_time_is_paired_with_the_solves_around_it(monkeypatch):
    ticks, units = itertools.count(), iter([0.1, 0.3, 0.2])
    monkeypatch.setattr(run.time, "perf_counter", lambda: next(ticks))
    monkeypatch.setattr(machine, "poisson_seconds", lambda shape: next(units))
    seconds, solves, made = run._Clock(SHAPE).time(lambda: "made")
    assert (seconds, made) == (1, "made")  # twice is enough
    assert solves == pytest.approx((1 / 0.2 + 1 / 0.25) / 2)


@pytest.mark.parametrize(
    ("setting", "value", "name"),
    [
        ("linearisations", 1, "1 linearisation"),
        ("linearisations", 3, "3 linearisations"),
        ("primal_dual_iterations", 5, "5 primal-dual steps"),
    ],
)
def test_names_of_estimates(setting, value, name):
    assert estimate_name({"setting": setting, "value": value}) == name


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--sizes", "16x16x15"), "expected numbers of voxels XxYxZ,XxYxZ, none below 16"),
        (("--sizes", "64"), "expected numbers of voxels"),
        (("--sizes", "big"), "expected numbers of voxels"),
        (("--json", "/no/such/folder/a.json"), "the folder /no/such/folder does not exist"),
        (("/no/such/truth.npz",), "/no/such/truth.npz: no such file"),
    ],
)
def test_refusals_come_before_any_work(words, sentence, capsys, idle):
    assert bench(*words) == 2
    assert sentence in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"voxel_size": -1.0}, "voxel_size and fps must be positive"),
        ({"frames": 2}, "has 2 frames; 3 pairs of them need at least 5"),
        ({"density": np.zeros((FRAMES, *SHAPE), np.float16)}, "frame 1 has no smoke that moves"),
        ({"shape": (16, 16, 32)}, "has 16x16x32 voxels, which are not among --sizes 16x16x24"),
    ],
)
def test_known_scenes_that_cannot_serve(changes, sentence, tmp_path, capsys, idle):
    truth = write_truth(tmp_path / "plume-9" / "truth.npz", **changes)
    assert bench(truth, "--sizes", "16x16x24") == 2
    assert sentence in " ".join(capsys.readouterr().err.split())


def test_a_file_that_is_no_truth_is_refused(tmp_path, capsys, idle):
    path = tmp_path / "broken.npz"
    path.write_bytes(b"PK\x03\x04 and no more")
    assert bench(path) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert f"{path}: cannot be read: it is no NumPy archive (.npz), or cut short." in said
