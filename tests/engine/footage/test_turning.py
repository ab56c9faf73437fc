"""Whether the camera of a clip turned, and how."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from turning_camera import COUNT, LENS, SIZE, between, clip_of, off, over_a_plain, pan, pictures, shake, wall

from smokelift.footage.turning import Turns, find_turns, moved
from smokelift.scene import Camera
from smokelift.scene.projection import project_points


def turns_of(frames: np.ndarray) -> Turns:
    found = find_turns(clip_of(frames), LENS)
    assert found is not None
    return found


@pytest.mark.parametrize("turns", [shake(3), pan(90)], ids=["shake", "pan"])
def test_turns_are_found_behind_smoke(turns: Rotation) -> None:
    found = turns_of(pictures(wall(), turns, smoke=0.9)[0])
    assert off(found.rotations, turns) < 0.1
    assert found.farthest == pytest.approx(replace(found, rotations=turns).farthest, abs=0.1)


@pytest.mark.parametrize(("smoke", "noise"), [(0.0, 1.0), (1.0, 1.0), (1.0, 12.0)])
def test_a_still_camera_stays_still(smoke: float, noise: float) -> None:
    frames, _ = pictures(wall(), Rotation.identity(COUNT), smoke, noise)
    assert find_turns(clip_of(frames), LENS) is None


@pytest.mark.parametrize("first", [2, COUNT - 2])
def test_a_camera_that_moves_for_a_moment_is_found(first: int) -> None:
    angles = np.zeros((COUNT, 3))
    angles[first : first + 2, 1] = 0.02
    assert turns_of(pictures(wall(), Rotation.from_rotvec(angles), smoke=0.9)[0]).farthest > 2


def test_smoke_before_one_colour_is_no_camera() -> None:
    frames, _ = pictures(np.full_like(wall(), 0.02), shake(3), smoke=1.0)
    assert find_turns(clip_of(frames), LENS) is None


def test_a_camera_that_travels_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"^The picture moves as .* travels .*\. Track it in Blender, .* as background\.$"
    ):
        find_turns(clip_of(over_a_plain(30)), LENS)


def test_a_camera_that_hardly_travels_is_not() -> None:
    assert find_turns(clip_of(over_a_plain(0.8)), LENS) is None


def test_too_little_texture_tells_nothing() -> None:
    frames = over_a_plain(30)
    frames[:, :, 75:] = 0.2
    assert find_turns(clip_of(frames), LENS) is None


def test_a_camera_carries_the_turns() -> None:
    turns = turns_of(pictures(wall(), shake(10))[0])
    mean = Camera.look_at((1, -4, 1), (0, 0, 0.8), fov_y_degrees=2 * np.degrees(np.arctan(0.3)), size=SIZE)
    moving = turns.carried(mean)
    assert moving.matrix == moving.matrices[0]
    point = np.array([[0.1, 0.2, 0.6]])
    where, _ = project_points(mean, point)
    for frame, turn in enumerate(turns.rotations):
        seen, _ = project_points(moving.at(frame), point)
        np.testing.assert_allclose(moved(seen, between(turn)), where, atol=1e-6)


def test_another_frame_of_the_shot_is_laid_in_the_clips_pose() -> None:
    turns = pan(90)
    frames, _ = pictures(wall(), turns, smoke=0.9)
    clip, own = clip_of(frames).part(4, 7), turns[4:8]
    found = find_turns(clip, LENS)
    assert found is not None
    other = found.of(frames[1])
    assert other is not None
    assert off(Rotation.concatenate([other]), own.mean().inv() * turns[1:2]) < 0.1
    assert found.of(frames[1][::-1]) is None
