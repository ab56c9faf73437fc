"""Whether the camera of a clip turned, and how."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation
from turning_camera import COUNT, LENS, SIZE, between, clip_of, off, over_a_plain, pan, pictures, shake, wall

from smokelift.footage.images import srgb_to_linear
from smokelift.footage.turning import Turns, find_turns, moved
from smokelift.scene import Camera
from smokelift.scene.projection import project


def turns_of(frames: np.ndarray) -> Turns:
    found = find_turns(clip_of(frames), LENS)
    assert found is not None
    return found


@pytest.mark.parametrize("turns", [shake(3), pan(90)], ids=["shake", "pan"])
def test_turns_are_found_behind_smoke(turns: Rotation) -> None:
    """To a tenth of a pixel in every corner of every frame."""
    found = turns_of(pictures(wall(), turns, smoke=0.9)[0])
    assert off(found.rotations, turns) < 0.1
    assert found.farthest == pytest.approx(replace(found, rotations=turns).farthest, abs=0.1)


@pytest.mark.parametrize(("smoke", "noise"), [(0.0, 1.0), (1.0, 1.0), (1.0, 12.0)])
def test_a_still_camera_stays_still(smoke: float, noise: float) -> None:
    """However the smoke moves before it, and however noisy it is."""
    frames, _ = pictures(wall(), Rotation.identity(COUNT), smoke, noise)
    assert find_turns(clip_of(frames), LENS) is None


def test_some_frames_prove_that_a_camera_stands_still(monkeypatch: pytest.MonkeyPatch) -> None:
    """Most are not examined."""
    frames, _ = pictures(wall(), Rotation.identity(COUNT), smoke=1.0)
    clip, looks = clip_of(np.repeat(frames, 4, axis=0)), set[int]()
    monkeypatch.setattr(clip, "stored", lambda n, stored=clip.stored: looks.add(n) or stored(n))
    assert find_turns(clip, LENS) is None
    assert 0 < len(looks) <= 13


@pytest.mark.parametrize("first", [2, COUNT - 2])
def test_a_camera_that_moves_for_a_moment_is_found(first: int) -> None:
    """Whenever that is."""
    angles = np.zeros((COUNT, 3))
    angles[first : first + 2, 1] = 0.02
    assert turns_of(pictures(wall(), Rotation.from_rotvec(angles), smoke=0.9)[0]).farthest > 2


def test_smoke_before_one_colour_is_no_camera() -> None:
    """Its texture is all there is, and rises."""
    frames, _ = pictures(np.full_like(wall(), 0.02), shake(3), smoke=1.0)
    assert find_turns(clip_of(frames), LENS) is None


def test_what_does_not_keep_its_shape_is_no_camera() -> None:
    """Texture everywhere that is another one in every frame."""
    random = np.random.default_rng(4)
    boil = ndimage.gaussian_filter(random.standard_normal((COUNT, SIZE[1], SIZE[0], 3)), (1, 3, 3, 0))
    frames = srgb_to_linear(np.clip(0.4 + 0.1 * boil / boil.std(), 0, 1)).astype(np.float32)
    assert find_turns(clip_of(frames), LENS) is None


def test_one_frame_shows_no_motion() -> None:
    frames, _ = pictures(wall(), Rotation.identity(1))
    assert find_turns(clip_of(frames), LENS) is None


def test_a_camera_that_travels_is_refused() -> None:
    """In one sentence that says what to do."""
    with pytest.raises(
        ValueError, match=r"^The picture moves as .* travels .*: track it in Blender, .* as background\.$"
    ):
        find_turns(clip_of(over_a_plain(30)), LENS)


def test_a_camera_that_hardly_travels_is_not() -> None:
    """It moves the picture by less than a pixel where it moves it most."""
    assert find_turns(clip_of(over_a_plain(0.8)), LENS) is None


def test_too_little_texture_tells_nothing() -> None:
    """A band of it, as smoke is before something smooth, may move in its own way."""
    frames = over_a_plain(30)
    frames[:, :, 75:] = 0.2
    assert find_turns(clip_of(frames), LENS) is None


def test_a_camera_carries_the_turns() -> None:
    """A point of the world lies where its direction does in each frame."""
    turns = turns_of(pictures(wall(), shake(10))[0])
    mean = Camera.look_at((1, -4, 1), (0, 0, 0.8), fov_y_degrees=2 * np.degrees(np.arctan(0.3)), size=SIZE)
    moving = turns.carried(mean)
    assert moving.matrix == moving.matrices[0]
    point = np.array([[0.1, 0.2, 0.6]])
    where, _ = project(mean, point)
    for frame, turn in enumerate(turns.rotations):
        seen, _ = project(moving.at(frame), point)
        np.testing.assert_allclose(moved(seen, between(turn)), where, atol=1e-6)


def test_another_frame_of_the_shot_is_laid_in_the_clips_pose() -> None:
    """One that the clip was trimmed to leave out, and none of another shot."""
    turns = pan(90)
    frames, _ = pictures(wall(), turns, smoke=0.9)
    clip, own = clip_of(frames).part(4, 7), turns[4:8]
    found = find_turns(clip, LENS)
    assert found is not None
    other = found.of(frames[1])
    assert other is not None
    assert off(Rotation.concatenate([other]), own.mean().inv() * turns[1:2]) < 0.1
    assert found.of(frames[1][::-1]) is None
