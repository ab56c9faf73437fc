"""Scores by azimuth: what is perfect, what each figure catches, and clips too short to say anything."""

import numpy as np
import pytest

from smokelift.evaluation.orbit import AZIMUTHS, BANDS, SHAPES, orbit_scores

FRAMES = 3


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
    assert flat["patches_worst"] == max(flat["patches_by_azimuth"]) == flat["patches_by_azimuth"][5]  # 90 degrees
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
