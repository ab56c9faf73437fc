"""``python -m benchmarks renderer``: the figures, the table, and peers that fail or are wrong."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.command import main
from benchmarks.renderer import run, worker
from benchmarks.renderer.peers import OURS, PEERS
from benchmarks.renderer.scene import bench_scene
from smokelift.render import device


@pytest.fixture(autouse=True)
def on_the_processor():
    device.start("cpu")


@pytest.fixture
def peers(monkeypatch):
    """No processes: Dr.Jit is Smokelift, the paper is it with an error; Mitsuba fails or is not installed.

    The n-th run of Smokelift takes n ms an iteration, as on a machine that gets busier; the peers take 60.
    """
    for key in ("drjit", "paper", "mitsuba-4"):
        monkeypatch.setitem(PEERS, key, replace(PEERS[key], packages=()))
    monkeypatch.setitem(PEERS, "mitsuba-1", replace(PEERS["mitsuba-1"], packages=("no_such_package",)))
    runs = itertools.count(1)

    def run_here(peer: str, folder: Path, lights: int, device: str) -> worker.Result:
        assert device == "cpu"
        if peer == "mitsuba-4":
            return worker.Result(failure="Out of memory.")
        scene = bench_scene(np.load(folder / "density.npy"), np.load(folder / "target.npy"), lights)
        result, image, gradient = worker.measure(OURS, scene)
        np.save(folder / "image.npy", image)
        np.save(folder / "gradient.npy", gradient * (1.01 if peer == "paper" else 1))
        return replace(result, seconds=(1e-3 * next(runs) if peer == OURS else 0.06,) * 5)

    monkeypatch.setattr(run, "run_apart", run_here)


def bench(*words: object) -> int:
    try:
        return main(["renderer", *map(str, words)])
    except SystemExit as leaving:
        assert isinstance(leaving.code, int)
        return leaving.code


def test_every_figure_in_json_and_in_the_table(peers, tmp_path, capsys):
    path = tmp_path / "bench.json"
    assert bench("--sizes", "12,8", "--peers", "drjit,paper,mitsuba-4,mitsuba-1", "--json", path) == 0
    results = json.loads(path.read_text())
    assert results["machine"]["cores"] > 0
    assert results["versions"]["numpy"] == np.__version__
    assert results["date"].startswith("20")
    assert [results["floor_ms"][size] > 0 for size in ("8", "12")] == [True, True]
    assert len(results["rows"]) == 2 * 2 * 5
    by_peer = {row["peer"]: row for row in results["rows"] if (row["size"], row["scene"]) == (8, "plume")}

    ours, right, wrong = by_peer[OURS], by_peer["drjit"], by_peer["paper"]
    assert ours["exact"]
    assert ours["image_error"] < 1e-6
    assert ours["milliseconds"] == pytest.approx([1] * 5 + [2] * 5 + [3] * 5)
    assert (ours["median"], ours["ratio"]) == (pytest.approx(2), None)
    assert ours["floors"] == pytest.approx(2 / results["floor_ms"]["8"])
    assert ours["compile_seconds"] > 0
    assert right["exact"]
    assert right["ratio"] == pytest.approx(60 / 1.5)
    assert wrong["ratio"] == pytest.approx(60 / 2.5)
    assert wrong["gradient_error"] == pytest.approx(0.01, rel=0.01)
    assert not wrong["exact"]
    assert by_peer["mitsuba-4"]["failure"] == "Out of memory."
    assert by_peer["mitsuba-1"]["failure"] == "not installed: pip install no_such_package"

    assert [row["share"] for row in results["shares"]] == list(run.SHARES)
    assert [row["lights"] for row in results["lights"]] == [1, 16]
    assert all(row["median"] > 0 and row["size"] == 12 for row in (*results["shares"], *results["lights"]))

    table = capsys.readouterr().out
    lines = {peer.title: [line for line in table.splitlines() if f"│ {peer.title} " in line] for peer in PEERS.values()}
    assert all("not exact" in line for line in lines[PEERS["paper"].title])
    assert not any("not exact" in line for line in (*lines[PEERS[OURS].title], *lines[PEERS["drjit"].title]))
    assert all("see below" in line for line in (*lines[PEERS["mitsuba-4"].title], *lines[PEERS["mitsuba-1"].title]))
    assert "Mitsuba 3 prbvolpath, 4 samples, 8^3, 12^3: Out of memory." in table
    assert "Mitsuba 3 prbvolpath, 1 sample, 8^3, 12^3: not installed: pip install no_such_package" in table
    assert "16 directional lights" in table


def test_results_so_far_stay_when_the_rest_is_cancelled(peers, tmp_path, monkeypatch):
    path = tmp_path / "bench.json"
    run_here = run.run_apart

    def until_the_second_size(peer: str, folder: Path, *rest: object) -> worker.Result:
        if len(np.load(folder / "density.npy")) > 8:
            raise KeyboardInterrupt
        return run_here(peer, folder, *rest)

    monkeypatch.setattr(run, "run_apart", until_the_second_size)
    assert bench("--sizes", "8,9", "--peers", OURS, "--json", path) == 130
    assert [row["size"] for row in json.loads(path.read_text())["rows"]] == [8, 8]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--sizes", "4"), "none below 8"),
        (("--sizes", "big"), "expected numbers of voxels"),
        (("--peers", "paper,cuda"), "'cuda': expected some of smokelift, drjit"),
        (("--json", "/no/such/folder/a.json"), "the folder /no/such/folder does not exist"),
    ],
)
def test_refusals_come_before_any_work(words, sentence, capsys, monkeypatch):
    monkeypatch.setattr(run, "run_apart", lambda *_: pytest.fail("ran"))
    assert bench(*words) == 2
    assert sentence in " ".join(capsys.readouterr().err.split())


def test_gpu_that_is_not_there(monkeypatch, capsys):
    monkeypatch.setattr(device, "available_gpu", lambda: None)
    assert bench("--device", "gpu") == 3
    assert "No GPU" in capsys.readouterr().err
