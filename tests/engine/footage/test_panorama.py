"""The background behind a camera that turns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from films import codes_apart
from PIL import Image
from scipy.spatial.transform import Rotation
from turning_camera import COUNT, LENS, SIZE, Frames, clip_of, pan, pictures, shake, wall

from smokelift.footage.backdrop import Backdrop, find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.mask import Mask, Masked
from smokelift.footage.matte import matte
from smokelift.footage.panorama import reprojected


def backdrop(clip: Clip) -> Backdrop:
    found = find_backdrop(clip, None, None, [LENS])
    assert found.steadied is not None
    return found


@pytest.mark.parametrize("turns", [shake(3), pan(90)], ids=["shake", "pan"])
def test_every_frame_has_its_background(turns: Rotation) -> None:
    """Where it is known it is right, and the matte before it is the smoke's."""
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


def test_a_part_has_the_parts_plate() -> None:
    turns = shake(3)
    frames, _ = pictures(wall(), turns)
    plates = backdrop(clip_of(frames)).plates
    part = plates.through(lambda whole: whole[10:50, 20:90], 1.0).at(3)
    np.testing.assert_array_equal(part.errors, plates.at(3).errors)
    np.testing.assert_array_equal(part.image, plates.at(3).image[10:50, 20:90])


def test_exposure_does_not_show_in_it() -> None:
    """A frame that is brighter by a third is brought to the others."""
    turns = shake(3)
    frames, clear = pictures(wall(), turns)
    frames[4] *= 1.33
    plates = backdrop(clip_of(frames)).plates
    assert np.percentile(codes_apart(plates.at(4).image, clear[4]), 90) < 6


def test_what_a_mask_hides_in_some_frames_comes_from_the_others(tmp_path: Path) -> None:
    """A block stands at the side of every picture while the camera pans past the wall."""
    turns = pan(90)
    frames, clear = pictures(wall(), turns)
    frames[:, 20:100, 5:55] = 0.01
    values = np.full((SIZE[1], SIZE[0]), 255, np.uint8)
    values[15:105, :60] = 0
    Image.fromarray(values).save(tmp_path / "mask.png")
    masked = Masked(Frames(frames), Mask(tmp_path / "mask.png", 0, COUNT - 1))
    plates = backdrop(Clip(Path("turning"), masked, None, None, masked=masked)).plates
    plate = plates.at(COUNT // 2)
    known = (plate.confidence > 0.5)[20:100, 40:60]
    assert known.mean() > 0.9
    assert np.percentile(codes_apart(plate.image, clear[COUNT // 2])[20:100, 40:60][known], 90) < 6


def test_a_homography_of_whole_pixels_copies() -> None:
    """Pixel centres are at half integers."""
    picture = np.random.default_rng(0).random((20, 30, 3)).astype(np.float32)
    moved = reprojected(picture, np.array([[1.0, 0, 3], [0, 1, 2], [0, 0, 1]]), (30, 20))
    np.testing.assert_allclose(moved[:18, :27], picture[2:, 3:], atol=1e-6)
    assert not moved[18:].any()
