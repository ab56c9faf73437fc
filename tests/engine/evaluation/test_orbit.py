"""Smoke on a turntable, lit; its scores by azimuth: what is perfect, and what each figure catches."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.evaluation.orbit import AZIMUTHS, BANDS, SHAPES, Orbit, gray, orbit_scores
from smokelift.scene import Background, DirectionalLight, Medium, PointLight

FRAMES = 3


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


@pytest.fixture(scope="module")
def perfect(plume, complete) -> dict:
    truth = plume.densities.__getitem__
    return orbit_scores(complete, FRAMES, truth, truth)


def drawn_out(density: np.ndarray) -> np.ndarray:
    """The front's smoke, constant along the rays."""
    return np.repeat(density.mean(1, keepdims=True), density.shape[1], 1)


@pytest.fixture(scope="module")
def flat(plume, complete) -> dict:
    """Scores of smoke that is drawn out."""
    truth = plume.densities.__getitem__
    return orbit_scores(complete, FRAMES, lambda frame: drawn_out(truth(frame)), truth)


def test_the_truth_is_perfect_and_smoke_drawn_out_in_depth_is_unlike_it_and_outside_it(perfect, flat) -> None:
    assert perfect["reference"] == "truth" and perfect["azimuths"] == list(AZIMUTHS)
    assert perfect["patches"] == perfect["patches_worst"] == 0 < perfect["patches_own"]
    assert perfect["edges"] == perfect["flicker"] == 1
    assert perfect["halo"] < 0.005
    assert len(perfect["patches_own_by_azimuth"]) == len(perfect["edges_by_azimuth"]) == len(AZIMUTHS)
    assert flat["patches"] > 1.5 * perfect["patches_own"]
    assert flat["patches_worst"] == max(flat["patches_by_azimuth"]) == flat["patches_by_azimuth"][AZIMUTHS.index(90)]
    assert flat["edges"] < 0.9
    assert flat["halo"] > 0.05


def test_shapes_along_the_cameras_rays_stand_beside_the_truths(plume, complete, perfect, flat):
    truth = plume.densities.__getitem__
    for name in SHAPES:
        assert perfect[f"{name}_by_azimuth"] == perfect[f"{name}_truth_by_azimuth"]
        assert perfect[name] == perfect[f"{name}_by_azimuth"][0]
    assert flat["depth_over_width"] > 1.5 * flat["depth_over_width_truth"]
    assert flat["ray_length"] > 1.5 * flat["ray_length_truth"]
    bands = zip(flat["depth_over_width_by_height"], flat["depth_over_width_truth_by_height"], strict=True)
    there = [(found, true) for found, true in bands if true is not None]
    assert 2 <= len(there) < BANDS and all(found > 1.5 * true for found, true in there)
    across = flat["shape_azimuths"].index(90)
    assert flat["ray_length_by_azimuth"][across] < flat["ray_length"]
    turned = orbit_scores(complete, FRAMES, lambda frame: np.ascontiguousarray(np.rot90(truth(frame), 1, (0, 1))))
    for name in SHAPES:
        assert turned[f"{name}_by_azimuth"][across] == pytest.approx(perfect[name], rel=1e-3, abs=1e-3)
    assert "scatter_truth" not in turned


def test_without_the_truth_it_is_unlike_its_front_as_well(plume, complete):
    truth = plume.densities.__getitem__
    own, other = (orbit_scores(complete, FRAMES, density) for density in (truth, lambda frame: drawn_out(truth(frame))))
    assert own["reference"] == "front" and own["halo"] is own["patches_own_by_azimuth"] is None
    assert own["patches"] < 0.5 * other["patches"]
    assert own["patches_own"] > 0
    assert own["edges"] == pytest.approx(1, abs=0.2) and other["edges"] < own["edges"]
    assert own["flicker"] == pytest.approx(1, abs=0.3)


def test_detail_that_changes_at_random_flickers(plume, complete):
    def noisy(frame: int) -> np.ndarray:
        noise = np.random.default_rng(frame).random((6, 6, 8), np.float32)
        return plume.densities[frame] * np.kron(2 * noise, np.ones((4, 4, 4), np.float32))

    found = orbit_scores(complete, 5, noisy, plume.densities.__getitem__)
    assert found["flicker"] > 1.3
    assert found["edges"] > 1.05


def test_few_frames_say_nothing_of_motion_and_no_smoke_nothing_at_all(plume, complete):
    one = orbit_scores(complete, 1, plume.densities.__getitem__)
    assert one["flicker"] is one["patches_own"] is None
    assert one["patches"] > 0
    empty = orbit_scores(complete, 3, lambda _: np.zeros(complete.domain.resolution, np.float32))
    assert {empty[name] for name in ("patches_own", "edges", "halo", "flicker")} <= {None, 0}
