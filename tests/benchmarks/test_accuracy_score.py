"""Figures and sheets of a run whose densities are known: the truth's own, and its front drawn out in depth."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy.blind import ANGLES, trial
from benchmarks.accuracy.blind import FRAMES as TRIAL_FRAMES
from benchmarks.accuracy.drift import course, parts_of, watched
from benchmarks.accuracy.scenes import KnownScene
from benchmarks.accuracy.score import BLACK, front_statistics, score
from benchmarks.accuracy.sheets import ORBIT_ANGLES, STRIP_FRAMES, orbit_rows, strip_rows, write_rows
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


def test_the_truth_has_the_truth_s_statistics(known, tmp_path) -> None:
    row = score(known, "truth", tmp_path, [front_statistics(known)])
    assert row["ssim_new"] == pytest.approx(1)
    assert row["spectrum_distance_new"] == pytest.approx(0, abs=1e-6)
    compared = [name for name in row if "_truth" in name]
    assert {"copied_detail_truth", "copied_detail_moments_truth", "flow_speed_truth_90"} < set(compared)
    for name in compared:
        assert row[name] == pytest.approx(row[name.replace("_truth", "")], abs=1e-6)


def test_a_front_drawn_out_in_depth_shows_in_its_side(known, drawn_out) -> None:
    row = score(known, "draft", drawn_out, [front_statistics(known)])
    assert row["depth_anisotropy"] < 0.01 < 0.7 < row["depth_anisotropy_truth"]
    assert row["spectrum_distance_90"] > 2
    for name in ("front_distance", "reference_distance"):
        assert row[f"{name}_90"] > row[f"{name}_truth_90"]
    assert row["front_distance_truth_0"] == pytest.approx(0, abs=1e-6)


def test_frames_that_do_not_follow_each_other_have_no_motion(known, tmp_path) -> None:
    row = score(replace(known, scored=range(0, FRAMES, 3)), "truth", tmp_path, [front_statistics(known)])
    assert not [name for name in row if name.startswith(("flow", "flicker"))]


def test_orbits_and_strips_show_truth_and_runs_below_each_other(known, drawn_out, tmp_path) -> None:
    """Runs without densities are left out."""
    runs = ["draft", "billboard", "truth"]
    orbits, strips = (rows(known, runs, lambda *_: drawn_out) for rows in (orbit_rows, strip_rows))
    assert [label.rpartition(": ")[2] for label, _ in orbits] == ["truth", "draft"]
    assert [label for label, _ in strips] == ["ball, frames 2 to 9: truth", "ball, frames 2 to 9: draft"]
    assert {len(tiles) for _, tiles in orbits} == {len(ORBIT_ANGLES)}
    assert {len(tiles) for _, tiles in strips} == {STRIP_FRAMES}
    front, side = (np.abs(orbits[0][1][n].astype(float) - orbits[1][1][n]).mean() for n in (0, 3))
    assert side > front
    write_rows(tmp_path / "orbit.png", orbits, [])
    assert read_image(tmp_path / "orbit.png").shape[1] > len(ORBIT_ANGLES) * 24


def test_a_blind_trial_shows_every_run_once_in_any_order(known, drawn_out) -> None:
    orders = set()
    for seed in range(4):
        rows, order = trial(known, ["truth", drawn_out.name], drawn_out.parent, np.random.default_rng(seed))
        assert sorted(order) == sorted(["truth", drawn_out.name])
        assert [len(row) for row in rows] == [len(ANGLES) * TRIAL_FRAMES] * 2
        lit = {run: (row[-1] > 8).mean() for run, row in zip(order, rows, strict=True)}
        assert lit["truth"] < lit[drawn_out.name]  # from the side that is drawn out
        orders.add(tuple(order))
    assert len(orders) == 2


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
