"""Calibrations of which a part is given."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.accuracy.exchange import Given, partly
from smokelift import Camera, Domain, Scene
from smokelift.scene import CompleteScene, completed
from smokelift.scene.projection import project


@pytest.fixture(scope="module")
def given() -> CompleteScene:
    """A camera that looks up by 20 degrees and aside, at a box in the left of its picture."""
    away = 4 * Rotation.from_euler("xz", [20, 50], degrees=True).as_matrix()[:, 1]
    camera = Camera.look_at(tuple(np.array([3.0, 1, 2]) - away), (3, 1, 2), fov_y_degrees=30, size=(80, 120))
    return completed(Scene(camera=camera, domain=Domain((2.4, 0.6, 1.2), (3.2, 1.4, 2.4), (16, 16, 24))))


@pytest.fixture(scope="module")
def found() -> CompleteScene:
    """A level camera with another lens, and a box as the clip alone gives it."""
    camera = Camera.look_at((0, -9, 1), (0, 0, 1), fov_y_degrees=24, size=(80, 120))
    return completed(Scene(camera=camera, domain=Domain((-0.9, -0.6, 0.2), (0.3, 0.6, 2.0), (20, 20, 30))))


def tilt(camera: Camera) -> float:
    """How much of the way that it looks goes down."""
    return np.array(camera.matrix)[2, 2]


def pixels_of_a_voxel(camera: Camera, domain: Domain) -> float:
    return domain.voxel_size * camera.fx / project(camera, np.array(domain.centre))[1]


def test_all_that_is_told_is_the_calibration_turned_about_the_vertical(given: CompleteScene, found: CompleteScene):
    camera, domain = partly(given, found, Given(True, True, True))
    middles = [project(scene.camera, np.array(scene.domain.centre)) for scene in (given, completed_by(camera, domain))]
    np.testing.assert_allclose(middles[0][0], middles[1][0])
    np.testing.assert_allclose(middles[0][1], middles[1][1])
    assert (camera.fx, domain.resolution) == (given.camera.fx, given.domain.resolution)
    np.testing.assert_allclose(np.array(domain.max) - domain.min, np.array(given.domain.max) - given.domain.min)
    assert tilt(camera) == pytest.approx(tilt(given.camera))
    np.testing.assert_allclose(np.array(camera.matrix)[0, 2], 0, atol=1e-9)  # along +Y


def test_nothing_told_is_what_was_found(given: CompleteScene, found: CompleteScene):
    camera, domain = partly(given, found, Given(False, False, False))
    assert camera == found.camera
    np.testing.assert_allclose(domain.centre[:2], found.domain.centre[:2], atol=1e-9)
    assert domain.min[2] == pytest.approx(found.domain.min[2])
    # no smaller, and by less than four voxels larger
    larger = (np.array(domain.max) - domain.min) - (np.array(found.domain.max) - found.domain.min)
    assert np.all((larger > -1e-9) & (larger < 4 * domain.voxel_size))


@pytest.mark.parametrize("parts", [Given(*each) for each in product((True, False), repeat=3)])
def test_parts_are_taken_one_by_one(parts: Given, given: CompleteScene, found: CompleteScene):
    camera, domain = partly(given, found, parts)
    assert camera.fx == (given if parts.focal else found).camera.fx
    assert tilt(camera) == pytest.approx(tilt((given if parts.tilt else found).camera), abs=1e-9)
    # the smoke's picture is where it was, and as fine everywhere
    assert pixels_of_a_voxel(camera, domain) == pytest.approx(pixels_of_a_voxel(given.camera, given.domain), rel=0.06)
    wanted = given if parts.box else found
    places = [
        project(scene.camera, marked(scene.domain, middle=parts.box))[0]  # pixels of 80 x 120
        for scene in (wanted, completed_by(camera, domain))
    ]
    np.testing.assert_allclose(*places, atol=1)


def marked(domain: Domain, *, middle: bool) -> np.ndarray:
    """The middle of a box that is given, or the lower end of one around the smoke."""
    x, y, z = domain.centre
    return np.array([x, y, z if middle else domain.min[2]])


def completed_by(camera: Camera, domain: Domain) -> CompleteScene:
    return completed(Scene(camera=camera, domain=domain))
