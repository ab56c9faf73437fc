"""Figures and sheets of a run whose densities are known: the truth's own, and its front drawn out in depth."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy import blind
from benchmarks.accuracy.blind import FIRST, moments, trial
from benchmarks.accuracy.drift import course, parts_of, watched
from benchmarks.accuracy.scenes import KnownScene
from benchmarks.accuracy.score import BLACK, score
from benchmarks.accuracy.sheets import STRIP_FRAMES, strip_rows, write_orbits
from smokelift.evaluation.truth import Truth
from smokelift.footage.images import read_image
from smokelift.render import scene_renderer
from smokelift.scene import Background, Camera, DirectionalLight, Domain, Medium, Scene, completed, orbit
from smokelift.transport import Velocity

SHAPE, FRAMES, VOXEL = (16, 16, 24), 10, 0.1
DOMAIN = Domain((-0.8, -0.8, 0), (0.8, 0.8, 2.4), SHAPE)
SCENE = Scene(
    camera=Camera.look_at((0, -6, 1.2), (0, 0, 1.2), fov_y_degrees=27, size=(48, 72)),
    domain=DOMAIN,
    medium=Medium(extinction=5.0, albedo=0.9),
    lights=(DirectionalLight((0.3, 0.5, -0.8), (12.0, 12.0, 12.0)),),
    background=Background(color=(0.0, 0.0, 0.0)),
    scattering="single",
)


def density(frame: int) -> np.ndarray:
    """A structured ball that rises by a voxel every other frame."""
    x, y, z = np.indices(SHAPE) - np.array([7.5, 7.5, 8 + frame / 2])[:, None, None, None]
    structure = 1 + 0.5 * np.sin(1.9 * x + y) * np.cos(1.7 * y) * np.sin(1.5 * z - x)
    return np.maximum(np.exp(-(x**2 + y**2 + z**2) / 14) * structure - 0.05, 0).astype(np.float32)


@pytest.fixture(scope="module")
def known(tmp_path_factory) -> KnownScene:
    path = tmp_path_factory.mktemp("ball") / "scene.toml"
    SCENE.save(path)
    rest = Velocity.zero(SHAPE, VOXEL).faces
    truth = Truth(
        densities=np.stack([density(frame) for frame in range(FRAMES)]).astype(np.float16),
        faces=tuple(np.stack([face] * FRAMES).astype(np.float16) for face in rest),
        inflow_packed=np.zeros((FRAMES, int(np.prod(SHAPE)) // 8), np.uint8),
        voxel_size=VOXEL,
        fps=24.0,
        closed=(),
    )
    cameras = {str(angle): orbit(SCENE.camera, DOMAIN, angle) for angle in (0, 20, 45, 90)}
    renderers = {view: scene_renderer(completed(SCENE), camera, BLACK) for view, camera in cameras.items()}
    seen = {
        (view, frame): renderer.image(truth.density(frame))
        for view, renderer in renderers.items()
        for frame in range(FRAMES)
    }
    span = range(FRAMES)
    return KnownScene(
        "ball", path, span, span, cameras, lambda view, frame: seen[view, frame], lambda *_: seen["0", 0], truth
    )


@pytest.fixture(scope="module")
def drawn_out(tmp_path_factory) -> Path:
    """A run whose every ray is constant in depth."""
    folder = tmp_path_factory.mktemp("drawn-out")
    SCENE.save(folder / "scene.toml")
    about = {"seconds": 1.0, "solves": 2.0, "memory_mib": 3.0, "method": "default"}
    (folder / "run.json").write_text(json.dumps(about | {"scattering": "single", "resolution": SHAPE}))
    for frame in range(FRAMES):
        np.savez(folder / f"{frame + 1:04d}.npz", density=np.repeat(density(frame).mean(1, keepdims=True), 16, 1))
    return folder


def test_the_truth_has_the_truth_s_orbit(known, tmp_path) -> None:
    row = score(known, "truth", tmp_path)
    assert row["ssim_new"] == pytest.approx(1)
    assert row["patches"] == 0 < row["patches_own"]
    assert (row["edges"], row["flicker"]) == pytest.approx((1, 1))


def test_a_front_drawn_out_in_depth_shows_in_its_orbit(known, drawn_out) -> None:
    row = score(known, "draft", drawn_out)
    assert row["patches_worst"] > row["patches"] > row["patches_own"]
    assert row["halo"] > 0.02


def test_a_run_without_densities_has_no_orbit(known, tmp_path) -> None:
    assert "patches" not in score(known, "black", tmp_path)


def test_pages_and_strips_show_truth_and_runs_below_each_other(known, drawn_out, tmp_path) -> None:
    """Runs without densities are left out."""
    runs = ["draft", "billboard", "truth"]
    write_orbits(known, runs, lambda *_: drawn_out, tmp_path / "orbit.png")
    page = read_image(tmp_path / "orbit.png")
    truth, run = (page[top : top + 240] for top in (32, 32 + 260))
    width = page.shape[1] // 10
    front, side = (np.abs(truth - run)[:, column : column + width].mean() for column in (0, 5 * width))
    assert side > front
    strips = strip_rows(known, runs, lambda *_: drawn_out)
    assert [label for label, _ in strips] == ["ball, frames 2 to 9: truth", "ball, frames 2 to 9: draft"]
    assert {len(tiles) for _, tiles in strips} == {STRIP_FRAMES}


def test_a_blind_trial_shows_every_run_once_in_any_order(known, drawn_out) -> None:
    orders = set()
    for seed in range(4):
        rng = np.random.default_rng(seed)
        rows, order = trial(known, ["truth", drawn_out.name], drawn_out.parent, 5, rng)
        assert sorted(order) == sorted(["truth", drawn_out.name])
        assert [len(row) for row in rows] == [10, 10]
        lit = {run: (row[5] > 8).mean() for run, row in zip(order, rows, strict=True)}
        assert lit["truth"] < lit[drawn_out.name]  # from the side that is drawn out
        orders.add(tuple(order))
    assert len(orders) == 2


def test_the_moments_of_a_blind_trial_differ(known) -> None:
    for count in (1, 2, 6):
        shown = moments(known, count, np.random.default_rng(0))
        assert len(set(shown)) == count and set(shown) <= set(known.scored)
    assert min(moments(known, 2, np.random.default_rng(0))) >= FIRST


def test_the_key_of_a_blind_trial_lies_beside_its_sheets(known, drawn_out, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(blind, "baked_scene", lambda *_: known)
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "ball").symlink_to(drawn_out.parent)
    words = [tmp_path / "sheets", tmp_path / "runs", "ball", "--runs", drawn_out.name, "--sheets", "2"]
    monkeypatch.setattr("sys.argv", ["blind", *map(str, words)])
    blind.main()
    assert sorted(path.name for path in (tmp_path / "sheets").iterdir()) == ["01.png", "02.png"]
    key = json.loads((tmp_path / "sheets_key.json").read_text())
    assert key["01"]["frame"] != key["02"]["frame"]
    assert {key["01"][letter] for letter in "AB"} == {"truth", drawn_out.name}


def test_a_long_run_is_scored_by_its_parts(known, tmp_path) -> None:
    """Smoke that is fast and thin in the second half only is so there only."""
    parts = list(parts_of(known, 2))
    assert [frame for part in parts for frame in part.scored] == list(known.scored)
    for frame in range(FRAMES):
        velocity = np.zeros((*SHAPE, 3), np.float32)
        velocity[3, 4, 5] = (0, 3, 4) if frame >= FRAMES // 2 else (0, 0, 1)
        share = 0.5 if frame >= FRAMES // 2 else 1
        np.savez(tmp_path / f"{frame + 1:04d}.npz", velocity=velocity, density=share * known.truth.density(frame))
    slow, quick = (course(part, known.truth, tmp_path) for part in parts)
    assert (slow["fastest"], slow["fastest_ever"], quick["fastest_ever"]) == pytest.approx((1, 1, 5))
    assert (slow["mass"], quick["mass_least"], quick["mass_largest"]) == pytest.approx((1, 0.5, 0.5))
    assert quick["fastest_truth"] == 0
    assert watched(parts[1]).scored == parts[1].scored  # it is short
    assert watched(replace(known, scored=range(100))).scored == range(38, 62)
