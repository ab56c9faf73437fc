"""The background behind a camera that turns."""

import numpy as np
import pytest
from films import codes_apart
from scipy.spatial.transform import Rotation
from turning_camera import LENS, clip_of, pan, pictures, shake, wall

from smokelift.footage.backdrop import Backdrop, find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.matte import matte
from smokelift.footage.panorama import reprojected


def backdrop(clip: Clip) -> Backdrop:
    found = find_backdrop(clip, None, None, [LENS])
    assert found.steadied is not None
    return found


@pytest.mark.parametrize("turns", [shake(3), pan(90)], ids=["shake", "pan"])
def test_every_frame_has_its_background(turns: Rotation) -> None:
    frames, clear = pictures(wall(), turns, smoke=0.9)
    plates = backdrop(clip_of(frames)).plates
    for number in (0, 5, 11):
        plate = plates.at(number)
        assert plate.image.shape == frames[number].shape
        known = plate.confidence > 0.5
        assert known.mean() > 0.5
        assert np.percentile(codes_apart(plate.image, clear[number])[known], 90) < 6
        smoke = codes_apart(frames[number], clear[number])
        found = matte(frames[number], plate).mask
        assert found[smoke > 60].mean() > 0.5
        assert found[smoke < 10].mean() < 0.3


def test_what_is_trimmed_shows_what_is_behind_the_smoke() -> None:
    """Smoke that stands in the frames that are used leaves the rest of the file, before and after them."""
    turns = shake(3)
    frames, clear = pictures(wall(), turns)
    for number in range(4, 8):
        seen = frames[number, 30:80, 50:100]
        seen[...] = 0.7 + 0.1 * number * (seen - 0.7)
    apart = []
    for clip in (clip_of(frames).part(4, 7), clip_of(frames[4:8])):
        plate = backdrop(clip).plates.at(1)
        apart.append(np.percentile(codes_apart(plate.image, clear[5])[35:75, 55:95], 90))
    assert apart[0] < 6
    assert apart[1] > 20


def test_a_homography_of_whole_pixels_copies() -> None:
    picture = np.random.default_rng(0).random((20, 30, 3)).astype(np.float32)
    moved = reprojected(picture, np.array([[1.0, 0, 3], [0, 1, 2], [0, 0, 1]]), (30, 20))
    np.testing.assert_allclose(moved[:18, :27], picture[2:, 3:], atol=1e-6)
    assert not moved[18:].any()
