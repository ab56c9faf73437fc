"""Smoke on a turntable: what is lit, what only absorbs, and lights that go around with the camera."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.evaluation.orbit import Orbit, gray
from smokelift.scene import Background, DirectionalLight, Medium, PointLight


@pytest.mark.parametrize(
    "light", [DirectionalLight((1, 0.2, -0.5), (5, 5, 5)), PointLight((-1.5, -0.3, 1), (8, 8, 8))], ids=["sun", "lamp"]
)
def test_smoke_that_turns_under_turning_lights_looks_the_same(plume, complete, light):
    lit = replace(complete, lights=(light,))
    density = plume.densities[2]
    turned = np.ascontiguousarray(np.rot90(density, 1, (0, 1)))  # by 90 degrees about the vertical
    front = Orbit(lit).picture(density, 0)
    with_camera = [Orbit(lit, lights_turn=True).picture(each, 90) for each in (turned, np.rot90(density, 3, (0, 1)))]
    fixed = [Orbit(lit).picture(each, 90) for each in (turned, np.rot90(density, 3, (0, 1)))]
    assert min(np.abs(picture - front).max() for picture in with_camera) < 0.01 * front.max()
    assert min(np.abs(picture - front).max() for picture in fixed) > 0.1 * front.max()


def test_the_background_does_not_count_and_smoke_is_before_black(plume, complete):
    density = plume.densities[2]
    bright = replace(complete, background=Background(color=(0.5, 0.5, 0.5)))
    picture = Orbit(bright).picture(density, 45)
    np.testing.assert_array_equal(picture, Orbit(complete).picture(density, 45))
    assert picture.max() > 0.2 and picture[:3].max() == 0


def test_smoke_that_only_absorbs_is_seen_by_its_shadow(plume, complete):
    density = plume.densities[2]
    lit = Orbit(complete).picture(density, 30)
    for dark in (replace(complete, lights=()), replace(complete, medium=Medium(8.0, albedo=0.0))):
        shadow = Orbit(dark).picture(density, 30)
        assert shadow.max() > 0.2 and shadow[:3].max() == pytest.approx(0, abs=1e-3)
        assert np.corrcoef((shadow > 0.05).ravel(), (lit > 0.05).ravel())[0, 1] > 0.8


def test_gray_values_are_as_they_are_seen():
    np.testing.assert_allclose(gray(np.array([[[0.2, 0.2, 0.2], [-1, -1, -1]]])), [[0.2 ** (1 / 2.2), 0]])
