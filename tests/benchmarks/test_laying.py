"""A result that is laid where a camera that only scores sees it best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.accuracy.laying import Result, Seen, best_laid, moved, pictures, scores, starts
from smokelift import Camera, DirectionalLight, Domain, Scene
from smokelift.scene import CompleteScene, completed
from smokelift.scene.projection import project

GRID = (10, 10, 14)
SIDE = Camera.look_at((5, 0, 0), (0, 0, 0), fov_y_degrees=30, size=(56, 84))


@pytest.fixture(scope="module")
def lopsided() -> np.ndarray:
    """Smoke that looks another from every side."""
    x, y, z = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in GRID), indexing="ij")
    blobs = ((0.1, 0.15, -0.2, 0.03), (-0.2, -0.05, 0.2, 0.015))
    return sum(np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / s) for a, b, c, s in blobs).astype(np.float32)


def scene(size: float, up: float = 0.0) -> CompleteScene:
    """A box so many metres wide with the input's camera before it, which looks up by so many degrees."""
    start = Rotation.from_euler("x", up, degrees=True).as_matrix() @ (0, -5 * size, 0)
    camera = Camera.look_at(tuple(start), (0, 0, 0), fov_y_degrees=30, size=(24, 36))
    box = Domain((-size / 2, -size / 2, -0.7 * size), (size / 2, size / 2, 0.7 * size), GRID)
    lit = Scene(camera=camera, domain=box, lights=(DirectionalLight((0, 1, -1), (4, 4, 4)),))
    return replace(completed(lit), scattering="unshadowed")


def test_a_camera_is_moved_about_the_middle():
    still, middle = np.eye(4), np.zeros(3)

    def place(by: list[float]) -> np.ndarray:
        return np.array(moved(SIDE, still, middle, np.array(by)).matrix)[:3, 3]

    np.testing.assert_allclose(place([0, 0, 0, 0.1, 0, 0]), (5.5, 0, 0), atol=1e-9)
    np.testing.assert_allclose(place([0, 0, np.pi / 2, 0, 0, 0.1]), (0, 5, 0.5), atol=1e-9)


@pytest.mark.parametrize("size, up", [(1.0, 0.0), (2.0, 0.0), (2.0, 17.0)])
def test_searches_start_from_worlds_that_look_alike_to_the_inputs_camera(size: float, up: float):
    given, other = scene(1.0), scene(size, up)
    upright, *_, turned = starts(given, other)
    assert len(starts(given, other)) == 10
    for way in (upright, turned):
        # as large, and at the same pixel
        np.testing.assert_allclose(np.linalg.det(way[:3, :3]), size**3)
        np.testing.assert_allclose(project(other.camera, way[:3, 3])[0], project(given.camera, np.zeros(3))[0])
    np.testing.assert_allclose(upright[:3, 2], (0, 0, size), atol=1e-9)
    alike = moved(given.camera, starts(given, other)[5], np.zeros(3), np.zeros(6))
    np.testing.assert_allclose(np.array(alike.matrix), np.array(other.camera.matrix), atol=1e-9)


def test_a_result_that_is_turned_far_is_turned_back(lopsided: np.ndarray):
    given = scene(1.0)
    result = Result(given, {3: lopsided})
    truly = moved(SIDE, np.eye(4), np.zeros(3), np.array([0.0, 0.05, 0.8, 0, 0, 0.01]))
    seen = Seen(SIDE, {3: 0.5 * pictures(result, truly, Seen(SIDE, {3: np.zeros(1)}))[0]})
    before = scores(result, SIDE, seen)
    laid = best_laid(result, starts(given, given), seen)
    after = scores(result, laid.camera, seen)
    assert after.gained[0] > before.gained[0] + 12
    assert after.gained[0] > after.plain[0] + 3  # another exposure is evened out by the gain
    assert max(laid.ends) - min(laid.ends) > 1  # not every start gets there
    away = np.linalg.norm(np.array(laid.camera.matrix)[:3, 3])
    assert away == pytest.approx(5, rel=0.03)


def test_half_as_many_voxels_show_about_the_same(lopsided: np.ndarray):
    result = Result(scene(1.0), {0: lopsided})
    seen = Seen(SIDE, {0: np.zeros(1)})
    whole, half = (pictures(each, SIDE, seen)[0] for each in (result, result.halved()))
    assert result.halved().densities[0].shape == (5, 5, 7)
    assert half.mean() == pytest.approx(whole.mean(), rel=0.1)
    assert np.corrcoef(half.ravel(), whole.ravel())[0, 1] > 0.95


def test_a_search_goes_on_until_it_has_converged(lopsided: np.ndarray):
    given = scene(1.0)
    result = Result(given, {0: lopsided})
    truly = moved(SIDE, np.eye(4), np.zeros(3), np.array([0.05, 0.05, 0.2, 0, 0.02, 0.01]))
    seen = Seen(SIDE, {0: pictures(result, truly, Seen(SIDE, {0: np.zeros(1)}))[0]})
    laid = best_laid(result, starts(given, given)[:1], seen)
    assert scores(result, laid.camera, seen).gained[0] > 42
