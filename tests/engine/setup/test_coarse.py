"""A few frames at low resolution: in the box, in two halves, of every camera."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from smokelift.extraction.plate import Plate, known_plate
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average
from smokelift.footage.noise import EIGHT_BIT_NOISE
from smokelift.output.images import write_image
from smokelift.scene import Domain, completed
from smokelift.setup.coarse import COARSE_SIDE, CoarseFrame, chequered, coarse_domain, coarse_frame, held_out
from smokelift.setup.geometry import working_picture
from smokelift.setup.shot import ShotView


@given(st.tuples(*[st.integers(8, 160)] * 3), st.floats(0.3, 20))
@example((8, 8, 33), 0.3)  # a side of one coarse voxel
@hypothesis_settings(deadline=None, max_examples=60, derandomize=True)
def test_a_coarse_box_stays_in_the_box(resolution, pixels) -> None:
    """A light beside the box must not come to stand in it; voxels are cubes, few, and not smaller than before."""
    x, y, z = resolution
    domain = Domain((0.0, 0.0, 0.0), (0.1 * x, 0.1 * y, 0.1 * z), resolution)
    coarse = coarse_domain(domain, pixels, COARSE_SIDE)
    assert max(coarse.resolution) <= max(COARSE_SIDE, 4)
    assert coarse.voxel_size >= domain.voxel_size * (1 - 1e-6)
    assert np.all(np.array(coarse.min) >= np.array(domain.min) - 1e-9)
    assert np.all(np.array(coarse.max) <= np.array(domain.max) + 1e-9)


def test_a_usual_box_keeps_its_corners() -> None:
    domain = Domain((-1.0, -1.0, 0.0), (1.0, 1.0, 3.0), (64, 64, 96))
    assert coarse_domain(domain, 4.0, COARSE_SIDE) == replace(domain, resolution=(16, 16, 24))


def test_the_halves_of_a_picture_are_apart(plume, tmp_path) -> None:
    """What is wrong in one pixel out of two is seen by one of them only, and both show what all show."""
    height, width = 112, 80
    rows, columns = np.indices((height, width))
    picture = np.repeat(np.where((rows + columns) % 2, 0.5, 0.2)[..., None], 3, -1).astype(np.float32)
    plate = Plate(np.zeros_like(picture), np.ones((height, width), np.float32), EIGHT_BIT_NOISE)
    scene = completed(replace(plume.scene, camera=plume.scene.camera.resized(width, height)))
    write_image(tmp_path / "frame_1.exr", picture, half=False)
    view = ShotView(
        Clip.open(tmp_path / "frame_1.exr"), scene.camera, plate, working_picture(scene.camera, scene.domain)
    )
    (seen,) = coarse_frame([view], 0, scene).views
    np.testing.assert_allclose(seen.fitted, 0.2, atol=1e-5)
    np.testing.assert_allclose(seen.held_out, 0.5, atol=1e-5)
    assert 0.3 < seen.picture.mean() < 0.4
    dimmed = seen.divided(np.full(3, 2, np.float32))
    np.testing.assert_allclose(dimmed.held_out, 0.25, atol=1e-5)
    away = scene.camera.look_at((0, -4, 0.8), (0, -9, 0.8), fov_y_degrees=27, size=(width, height))
    assert coarse_frame([view, replace(view, camera=away)], 0, scene) is None


# the judge


@pytest.fixture
def blob(plume) -> CoarseFrame:
    """A coarse frame of the blob in its own light."""
    scene, clip = completed(plume.scene), Clip.open(plume.scene.clip)
    behind = np.zeros((*clip.size[::-1], 3), np.float32)
    view = ShotView(clip, scene.camera, known_plate(behind, clip)[0], working_picture(scene.camera, scene.domain))
    found = coarse_frame([view], 2, scene)
    return found


def test_the_right_light_and_model_leave_the_least_and_a_wrong_light_is_asked_to_change(blob, draft) -> None:
    right = held_out([blob], "single", "single", draft.density)
    wrong = held_out([blob], "unshadowed", "single", draft.density)
    assert right.error < 0.05 < wrong.error
    np.testing.assert_allclose(right.gains, 1, atol=0.05)
    (sun,) = blob.scene.lights
    red, green, blue = sun.irradiance
    tinted = replace(blob, scene=replace(blob.scene, lights=(replace(sun, irradiance=(red, green, 2 * blue)),)))
    (gain,) = held_out([tinted], "single", "single", draft.density).gains
    assert gain[2] / gain[0] == pytest.approx(0.5, rel=0.05)
    assert (held_out([blob], "absorption", "absorption", draft.density).gains == 1).all()


@pytest.mark.parametrize("size", [(7, 5), (31, 40), (64, 48), (80, 40), (80, 60)])
@pytest.mark.parametrize("first", [0, 1])
def test_averages_of_a_chequerboard(size, first) -> None:
    picture, (rows, columns) = np.random.default_rng(0).random((48, 64, 3), np.float32), np.indices((48, 64))
    for color, found in enumerate(chequered(picture, *size, first)):
        board = ((rows + columns) % 2 == (first + color) % 2).astype(np.float32)
        weight = np.maximum(area_average(board, *size), np.float32(1e-6))
        assert np.array_equal(found, area_average(picture * board[..., None], *size) / weight[..., None])
