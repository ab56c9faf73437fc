"""The clips that are compared with a clean one: their files, their figures and the table."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.background.clips import Smoke
from benchmarks.clean_clip.__main__ import table
from benchmarks.clean_clip.measure import score, write
from benchmarks.clean_clip.rows import Clips, Film
from benchmarks.clean_clip.smoke import FRONT, SCORED, Baked
from smokelift import Camera, Clip, DirectionalLight, Domain, Medium, Scene
from smokelift.footage.images import linear_to_srgb
from smokelift.render import scene_renderer
from smokelift.scene import completed

COUNT, GRID, SIZE = 40, (8, 8, 12), (32, 48)


@pytest.fixture(scope="module")
def ball() -> Baked:
    """A ball of smoke that grows, seen from two sides."""
    x, y, z = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in GRID), indexing="ij")
    grows = 0.05 + 0.05 * np.arange(COUNT)[:, None, None, None] / COUNT
    densities = np.maximum(1 - (x**2 + y**2 + z**2) / grows, 0).astype(np.float32)
    cameras = {
        FRONT: Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=SIZE),
        "90": Camera.look_at((7, 0, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=SIZE),
    }
    scene = Scene(
        camera=cameras[FRONT],
        domain=Domain((-1, -1, 0), (1, 1, 3), GRID),
        medium=Medium(3, 0.8),
        lights=(DirectionalLight((-0.4, 0.5, -0.8), (8, 8, 8)),),
        scattering="single",
    )
    radiance, transmittance = {}, {}
    for view, camera in cameras.items():
        renderer = scene_renderer(completed(scene), camera, np.zeros(3, np.float32))
        seen = [(renderer.image(density)[..., 0], renderer.transmittance) for density in densities]
        radiance[view], transmittance[view] = (np.stack(pictures) for pictures in zip(*seen, strict=True))
    return Baked(
        name="ball",
        scene=scene,
        front=Smoke(radiance[FRONT], transmittance[FRONT]),
        cameras=cameras,
        radiance={view: pictures[list(SCORED)] for view, pictures in radiance.items()},
        transmittance={view: pictures[list(SCORED)] for view, pictures in transmittance.items()},
        densities=densities,
    )


def test_every_row_comes_after_the_clean_one_that_it_is_compared_with(ball) -> None:
    rows = Clips(ball).rows()
    names = list(rows)
    assert all(names.index(row.clean) <= names.index(name) for name, row in rows.items())
    assert {row.clean for row in rows.values()} == {name for name, row in rows.items() if row.clean == name}


def test_a_clip_is_written_without_loss_and_tells_what_it_says(ball, tmp_path) -> None:
    film = Clips(ball).rows()["wall, given"].film()
    scene = Scene.load(write(film, tmp_path))
    assert scene.background is not None
    assert scene.medium == ball.scene.medium
    assert "color" not in (tmp_path / "scene.toml").read_text()  # which earlier states of the code do not know
    with Clip.open(scene.clip) as clip:
        assert len(clip) == COUNT
        assert np.abs(linear_to_srgb(clip.frame(20)) - film.pictures[20]).max() < 0.51 / 255


def test_nothing_is_told_where_the_row_says_so(ball, tmp_path) -> None:
    scene = Scene.load(write(Clips(ball).rows()["black, medium unknown, coloured"].film(), tmp_path))
    assert scene.background is None
    assert scene.medium is None


def test_hybrid_log_gamma_shows_the_same_light(ball, tmp_path) -> None:
    film = Clips(ball).rows()["wall, 10 bit HLG"].film()
    with Clip.open(Scene.load(write(film, tmp_path)).clip) as clip:
        assert np.abs(linear_to_srgb(clip.frame(20)) - linear_to_srgb(film.pictures[20])).max() < 1.5 / 255


def test_a_column_stays_in_its_pixels_and_adds_mass(ball) -> None:
    standing = ball.standing()
    least = (1 - standing.front.transmittance).min(0)
    assert (least > 0.3).any(axis=1).mean() > 0.75  # in every row that shows the box
    assert standing.mass() > 1.2 * ball.mass()
    assert standing.front.radiance[0] != pytest.approx(standing.front.radiance[-1], abs=0.01)


def test_the_truth_scores_as_the_truth(ball, tmp_path) -> None:
    film = Film(ball, linear_to_srgb(np.repeat(ball.front.radiance[..., None], 3, -1)))
    ball.scene.save(tmp_path / "scene.toml")
    (tmp_path / "run.json").write_text(json.dumps({"scattering": "single"}))
    for number, density in enumerate(ball.densities, 1):
        np.savez(tmp_path / f"{number:04d}.npz", density=density)
    figures = score(film, tmp_path)
    assert figures["views"] > 60
    assert figures["mass"] == pytest.approx(1)
    halved = replace(ball, scene=replace(ball.scene, medium=Medium(1.5, 0.8)))
    assert score(replace(film, smoke=halved), tmp_path)["mass"] == pytest.approx(2)


def test_the_table_compares_with_the_clean_clip_of_the_same_code(ball) -> None:
    rows = {name: row for name, row in Clips(ball).rows().items() if name in ("wall, given", "wall")}
    results = {
        "now / a / wall, given": {"views": 25.0, "front": 30.0, "mass": 0.8},
        "now / a / wall": {"views": 24.0, "front": 30.0, "mass": 0.6},
        "now / b / wall, given": {"views": 23.0, "front": 30.0, "mass": 1.0},
        "now / b / wall": {"refused": "The camera travels."},
    }
    assert "| wall | -1.0 (-1.0) | -25% (-25%) |" in table(results, rows, ["now"], ["a"])
    assert "| wall | refused | refused |" in table(results, rows, ["now"], ["a", "b"])
    assert "| **wall, given** | 24.0 | 0.90 |" in table(results, rows, ["now"], ["a", "b"])
