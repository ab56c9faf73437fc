"""A result of which nothing was told, laid where a camera that only scores sees it best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy.uncalibrated import Found, View, best_laid, laid_on, scores
from smokelift import Camera, DirectionalLight, Domain, Scene
from smokelift.render import scene_renderer
from smokelift.scene import CompleteScene, completed

GRID = (10, 10, 14)


@pytest.fixture(scope="module")
def lopsided() -> np.ndarray:
    """Smoke that looks another from every side."""
    x, y, z = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in GRID), indexing="ij")
    blobs = ((0.1, 0.15, -0.2, 0.03), (-0.2, -0.05, 0.2, 0.015))
    return sum(np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / s) for a, b, c, s in blobs).astype(np.float32)


def scene(size: float) -> CompleteScene:
    """A box so many metres wide with the input's camera before it."""
    camera = Camera.look_at((0, -5 * size, 0), (0, 0, 0), fov_y_degrees=30, size=(24, 36))
    box = Domain((-size / 2, -size / 2, -0.7 * size), (size / 2, size / 2, 0.7 * size), GRID)
    lit = Scene(camera=camera, domain=box, lights=(DirectionalLight((0, 1, -1), (4, 4, 4)),))
    return replace(completed(lit), scattering="unshadowed")


def test_a_world_of_another_size_is_laid_on_the_one_that_is_told(lopsided: np.ndarray):
    told, other = scene(1.0), scene(2.0)
    side = Camera.look_at((5, 0, 0), (0, 0, 0), fov_y_degrees=30, size=(24, 36))
    view = View(side, laid_on(told, other), np.zeros(3))
    np.testing.assert_allclose(np.array(view.moved(np.zeros(7)).matrix)[:3, 3], (10, 0, 0), atol=1e-9)
    # a scale moves the camera away, a turn goes about the centre, a shift is one of the distance
    np.testing.assert_allclose(np.array(view.moved(np.array([0, 0, 0, 0, 0, 0, np.log(2)])).matrix)[0, 3], 20)
    np.testing.assert_allclose(
        np.array(view.moved(np.array([0, 0, np.pi / 2, 0, 0.1, 0, 0])).matrix)[:3, 3], (0, 11, 0), atol=1e-9
    )


def test_a_result_that_is_turned_is_turned_back(lopsided: np.ndarray):
    told = scene(1.0)
    side = Camera.look_at((5, 0, 0), (0, 0, 0), fov_y_degrees=30, size=(24, 36))
    view = View(side, laid_on(told, told), np.zeros(3))
    truly = view.moved(np.array([0.0, 0, 0.15, 0, 0, 0.01, 0]))
    picture = 0.5 * scene_renderer(told, truly, np.zeros(3, np.float32)).image(lopsided)
    found = Found(told, {3: lopsided}, [], [], [], [])
    before = scores(found, view.moved(np.zeros(7)), {3: picture})
    laid = best_laid(found, view, {3: picture}, scaled=False)
    after = scores(found, view.moved(laid), {3: picture})
    assert after[1] > before[1] + 6 and after[1] > after[0] + 3  # another exposure is evened out by the gain
    assert laid[6] == 0
