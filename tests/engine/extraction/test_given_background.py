"""The background that a scene gives, and what a camera sees of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from smokelift.extraction.given_background import background_picture, mean_of_frames, open_plates, read_background
from smokelift.extraction.plate import known_plate
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError
from smokelift.output.images import write_image
from smokelift.scene import Background, Camera, ClipSource, Scene, look_at_matrix
from tests.engine.films import COUNT, HEIGHT, WIDTH, clip_of, codes_apart, pan, passing_wall

CAMERA = Camera.look_at((0, -4, 0), (0, 0, 0), fov_y_degrees=30, size=(WIDTH, HEIGHT))


@pytest.fixture
def folder(tmp_path) -> Path:
    """A clip of smoke before a passing wall, and the wall alone, frame by frame."""
    for name, smoke in (("clip", 1.0), ("plate", 0.0)):
        pan(tmp_path / name, passing_wall(), smoke).close()
    return tmp_path


def test_a_color_or_a_picture_is_one_plate_for_all_frames(folder) -> None:
    clip = pan(folder / "clip", passing_wall(), 1.0)
    color, picture = Background(color=(0.1, 0.2, 0.3)), Background(image=folder / "plate" / "frame_003.png")
    for background, behind, codes in ((color, (0.1, 0.2, 0.3), 0.1), (picture, passing_wall()[:, 6 : 6 + WIDTH], 6)):
        plate, _ = known_plate(read_background(background, None), clip)
        assert plate.at(0) is plate.at(COUNT - 1)
        assert codes_apart(plate.image, np.broadcast_to(behind, plate.image.shape)).max() < codes


def test_frames_of_the_clip_are_its_plate_as_they_were_filmed(tmp_path) -> None:
    """Also where a mask hides a part of them, and outside the frames in use; those that do not exist are refused."""
    filmed = np.random.default_rng(0).uniform(0.1, 0.9, (4, 24, 32, 3)).astype(np.float32)
    clip_of(tmp_path, filmed, ".exr").close()
    seen = np.zeros((24, 32), np.float32)
    seen[:, :20] = 1
    write_image(tmp_path / "mask.png", seen)
    for mask in (None, tmp_path / "mask.png"):
        with Clip.open(tmp_path / "frame_###.exr", frames=(1, 2), mask=mask) as clip:
            np.testing.assert_allclose(mean_of_frames((0, 3), clip), filmed[[0, 3]].mean(0), atol=1e-3)
            with pytest.raises(ClipError, match="frame 4"):
                mean_of_frames((4,), clip)


def test_pictures_are_a_plate_a_frame_and_are_cut_like_one(folder) -> None:
    clip = pan(folder / "clip", passing_wall(), 1.0)
    behind = read_background(Background(image=folder / "plate" / "frame_###.png"), CAMERA)
    plate, _ = known_plate(behind, clip)
    part = plate.through(lambda picture: picture[8:40]).through(lambda picture: picture[:, 4:])
    for n in (0, 9):
        np.testing.assert_array_equal(part.at(n).image, plate.at(n).image[8:40, 4:])
        np.testing.assert_array_equal(part.at(n).noise.total, plate.at(n).noise.total)


def test_a_numbered_picture_begins_a_sequence_before_a_moving_camera(folder) -> None:
    moving = replace(CAMERA, matrices=(CAMERA.matrix,) * COUNT)
    plates = open_plates(Background(image=folder / "plate" / "frame_000.png"), moving)
    assert len(plates) == COUNT


def test_a_camera_sees_its_own_plate_and_others_its_mean(folder) -> None:
    first = folder / "plate" / "frame_002.png"
    clip = ClipSource(folder / "clip" / "frame_###.png", frames=(2, 9))
    for image in (first, folder / "plate" / "frame_###.png"):
        scene = Scene(camera=CAMERA, clip=clip, background=Background(image=image))
        own = background_picture(scene)
        assert codes_apart(own, passing_wall()[:, 4 : 4 + WIDTH]).max() < 6
        aside = replace(CAMERA, matrix=look_at_matrix((1.0, -4.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)))
        np.testing.assert_allclose(background_picture(scene, aside), own.reshape(-1, 3).mean(0), rtol=1e-5)
        part = background_picture(scene, CAMERA.cropped(2, 3, 10, 8))
        np.testing.assert_allclose(part, own[3:11, 2:12], rtol=1e-5)


def test_a_color_is_seen_by_every_camera_and_nothing_is_black() -> None:
    scene = Scene(background=Background(color=(0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(background_picture(scene, CAMERA), np.float32([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(background_picture(Scene(camera=CAMERA)), np.zeros(3))
